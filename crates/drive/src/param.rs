//! Tuning parameters, declared once: value, default, unit, range, scale, meaning and where the default came from.

use serde_json::{Map, Value};

use crate::json;

/// How a slider maps its travel to values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Equal steps.
    Linear,
    /// Equal ratios.
    Log,
}

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Kind {
    /// A number in a range.
    Number {
        /// Default value.
        default: f64,
        /// Smallest accepted value.
        min: f64,
        /// Largest accepted value.
        max: f64,
        /// How a slider moves.
        scale: Scale,
    },
    /// A number in a range, or nothing: the estimator then finds its own.
    Optional {
        /// Smallest accepted value.
        min: f64,
        /// Largest accepted value.
        max: f64,
    },
    /// On or off.
    Toggle {
        /// Default state.
        default: bool,
    },
    /// One of a list of names.
    Choice {
        /// Name of the default.
        default: &'static str,
        /// All names.
        options: &'static [&'static str],
    },
}

/// Everything a slider, a range check and a manual page need to know about one parameter.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ParamSpec {
    /// Name in the field's words.
    pub name: &'static str,
    /// The symbol of the specification, accepted as a second name; empty if there is none.
    pub symbol: &'static str,
    /// SI unit; `1` for a pure number.
    pub unit: &'static str,
    /// What it is and what a larger value does.
    pub doc: &'static str,
    /// Where the default came from.
    pub source: &'static str,
    /// Values and default.
    #[serde(flatten)]
    pub kind: Kind,
}

/// One parameter's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamValue {
    /// A number; NaN is "not given" for [`Kind::Optional`].
    Number(f64),
    /// On or off.
    Toggle(bool),
    /// Name of a choice.
    Choice(&'static str),
}

impl ParamValue {
    /// As JSON: number, boolean, text, or null where not given.
    pub fn to_json(self) -> Value {
        match self {
            Self::Number(v) => serde_json::Number::from_f64(v).map_or(Value::Null, Value::Number),
            Self::Toggle(v) => Value::Bool(v),
            Self::Choice(v) => Value::String(v.into()),
        }
    }
}

/// A parameter value that cannot be taken.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum ParamError {
    /// No parameter has this name.
    #[error("no parameter `{name}`; there are {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// The value is outside its range.
    #[error("`{name}` = {value} {unit} is outside {min}..={max}")]
    OutOfRange {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Smallest accepted.
        min: f64,
        /// Largest accepted.
        max: f64,
    },
    /// The value is of another kind.
    #[error("`{name}` expects {expected}, found {found}")]
    WrongKind {
        /// The parameter.
        name: &'static str,
        /// What it takes.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The whole is not an object of names and values.
    #[error("parameters are a JSON object of names and values, found {0}")]
    NotAnObject(String),
}

impl ParamSpec {
    /// The default value.
    pub fn default_value(&self) -> ParamValue {
        match self.kind {
            Kind::Number { default, .. } => ParamValue::Number(default),
            Kind::Optional { .. } => ParamValue::Number(f64::NAN),
            Kind::Toggle { default } => ParamValue::Toggle(default),
            Kind::Choice { default, .. } => ParamValue::Choice(default),
        }
    }

    /// Read a JSON value (or the text of a command line) as this parameter's, checked against its range.
    ///
    /// # Errors
    /// [`ParamError::WrongKind`] or [`ParamError::OutOfRange`].
    pub fn parse(&self, value: &Value) -> Result<ParamValue, ParamError> {
        let wrong = |expected: String| ParamError::WrongKind { name: self.name, expected, found: json::named(value) };
        let number = || match value {
            Value::Number(n) => n.as_f64(),
            Value::String(s) => s.trim().parse::<f64>().ok().filter(|v| v.is_finite()),
            _ => None,
        };
        let in_range = |v: f64, min: f64, max: f64| {
            if v >= min && v <= max {
                return Ok(ParamValue::Number(v));
            }
            Err(ParamError::OutOfRange { name: self.name, value: v, unit: self.unit, min, max })
        };
        match self.kind {
            Kind::Number { min, max, .. } => {
                in_range(number().ok_or_else(|| wrong(format!("a number in {}", self.unit)))?, min, max)
            }
            Kind::Optional { min, max } => {
                if value.is_null() || value.as_str().is_some_and(|s| matches!(s.trim(), "" | "none" | "auto")) {
                    return Ok(ParamValue::Number(f64::NAN));
                }
                in_range(number().ok_or_else(|| wrong(format!("a number in {} or none", self.unit)))?, min, max)
            }
            Kind::Toggle { .. } => match value {
                Value::Bool(b) => Ok(ParamValue::Toggle(*b)),
                Value::String(s) if matches!(s.trim(), "true" | "on") => Ok(ParamValue::Toggle(true)),
                Value::String(s) if matches!(s.trim(), "false" | "off") => Ok(ParamValue::Toggle(false)),
                _ => Err(wrong("true or false".into())),
            },
            Kind::Choice { options, .. } => value
                .as_str()
                .and_then(|s| options.iter().find(|o| **o == s.trim()))
                .map(|o| ParamValue::Choice(o))
                .ok_or_else(|| wrong(format!("one of {}", options.join(", ")))),
        }
    }
}

/// A set of parameters. Written with [`params!`](crate::params), never by hand.
pub trait Params: Default + Clone {
    /// The declarations, in order.
    const SPECS: &'static [ParamSpec];
    /// Value of a parameter by index.
    fn get(&self, index: usize) -> ParamValue;
    /// Put a value that [`ParamSpec::parse`] has accepted.
    fn put(&mut self, index: usize, value: ParamValue);

    /// Set a parameter by name or symbol.
    ///
    /// # Errors
    /// Unknown name, wrong kind, or out of range; nothing is changed then.
    fn set(&mut self, name: &str, value: &Value) -> Result<(), ParamError> {
        let index = index_of(Self::SPECS, name)?;
        let value = Self::SPECS[index].parse(value)?;
        self.put(index, value);
        Ok(())
    }

    /// Defaults overridden by a JSON object.
    ///
    /// # Errors
    /// The first value that cannot be taken.
    fn from_json(json: &Value) -> Result<Self, ParamError> {
        let mut params = Self::default();
        put_all(Self::SPECS, json, &mut |index, value| params.put(index, value))?;
        Ok(params)
    }

    /// All values as a JSON object.
    fn to_json(&self) -> Value {
        object(Self::SPECS, &|index| self.get(index))
    }

    /// Check every value against its declaration.
    ///
    /// # Errors
    /// The first value out of range.
    fn validate(&self) -> Result<(), ParamError> {
        check_all(Self::SPECS, &|index| self.get(index))
    }
}

// What the methods above share, compiled once for all parameters.

#[inline(never)]
fn index_of(specs: &[ParamSpec], name: &str) -> Result<usize, ParamError> {
    let by_symbol = || specs.iter().position(|s| !s.symbol.is_empty() && s.symbol == name);
    specs.iter().position(|s| s.name == name).or_else(by_symbol).ok_or_else(|| ParamError::Unknown {
        name: name.into(),
        known: specs.iter().map(|s| s.name).collect::<Vec<_>>().join(", "),
    })
}

#[inline(never)]
fn put_all(specs: &[ParamSpec], json: &Value, put: &mut dyn FnMut(usize, ParamValue)) -> Result<(), ParamError> {
    let map = match json {
        Value::Null => return Ok(()),
        Value::Object(map) => map,
        other => return Err(ParamError::NotAnObject(json::named(other))),
    };
    for (name, value) in map {
        let index = index_of(specs, name)?;
        put(index, specs[index].parse(value)?);
    }
    Ok(())
}

#[inline(never)]
fn object(specs: &[ParamSpec], get: &dyn Fn(usize) -> ParamValue) -> Value {
    // One by one: collecting into a map sorts first, with code of its own.
    let mut map = Map::new();
    for (i, spec) in specs.iter().enumerate() {
        map.insert(spec.name.to_string(), get(i).to_json());
    }
    Value::Object(map)
}

#[inline(never)]
fn check_all(specs: &[ParamSpec], get: &dyn Fn(usize) -> ParamValue) -> Result<(), ParamError> {
    specs.iter().enumerate().try_for_each(|(i, s)| s.parse(&get(i).to_json()).map(drop))
}

/// A parameter that is one of a list of names. Written with [`choice!`](crate::choice).
pub trait Choice: Copy + Default {
    /// All names, in order; the first is the default.
    const NAMES: &'static [&'static str];
    /// Name of this value.
    fn name(self) -> &'static str;
    /// The value of a name.
    fn from_name(name: &str) -> Option<Self>;
}

/// Declare an enum of named choices; the first is the default.
#[macro_export]
macro_rules! choice {
    ($(#[doc = $edoc:literal])* $vis:vis enum $name:ident {
        $(#[doc = $fdoc:literal])+ $first:ident = $ftext:literal,
        $( $(#[doc = $doc:literal])+ $variant:ident = $text:literal, )*
    }) => {
        $(#[doc = $edoc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        $vis enum $name {
            $(#[doc = $fdoc])+ #[default] $first,
            $( $(#[doc = $doc])+ $variant, )*
        }
        impl $crate::param::Choice for $name {
            const NAMES: &'static [&'static str] = &[ $ftext, $($text),* ];
            fn name(self) -> &'static str { match self { Self::$first => $ftext, $( Self::$variant => $text, )* } }
            fn from_name(name: &str) -> Option<Self> {
                match name { $ftext => Some(Self::$first), $( $text => Some(Self::$variant), )* _ => None }
            }
        }
    };
}

/// Declare a set of parameters once.
///
/// ```
/// drivescope_drive::choice! {
///     /// Which filter.
///     pub enum Variant {
///         /// The first is the default.
///         Simple = "simple",
///         /// Another.
///         Full = "full",
///     }
/// }
/// drivescope_drive::params! {
///     /// Tuning.
///     pub struct Tuning {
///         /// Grade random walk.
///         grade_walk ("q2_th"): number = 0.04, "rad/sqrt(s)", 0.005 ..= 0.3 Log, from "SPEC slope 5";
///         /// Heading to start from.
///         initial_yaw (""): optional, "rad", -7.0 ..= 7.0, from "none: found from the course";
///         /// Use the rear-axle aid.
///         rear_axle_aid ("vy_aid"): toggle = true, from "SPEC slope 3";
///         /// Which filter.
///         variant (""): choice Variant, from "ours";
///     }
/// }
/// use drivescope_drive::param::Params;
/// let t = Tuning::from_json(&serde_json::json!({"q2_th": 0.02, "variant": "full"})).unwrap();
/// assert_eq!((t.grade_walk, t.variant), (0.02, Variant::Full));
/// ```
#[macro_export]
macro_rules! params {
    ($(#[doc = $sdoc:literal])* $vis:vis struct $name:ident {
        $( $(#[doc = $doc:literal])+ $field:ident ( $symbol:literal ) : $kind:ident $($ty:ident)? $(= $default:expr)?
            $(, $unit:literal, $min:literal ..= $max:literal $($scale:ident)?)? , from $source:literal ; )+
    }) => {
        $(#[doc = $sdoc])*
        #[derive(Clone, Debug, PartialEq)]
        $vis struct $name { $( $(#[doc = $doc])+ #[doc = concat!("\n\nDefault from: ", $source)]
            pub $field: $crate::params!(@type $kind $($ty)?), )+ }
        impl Default for $name {
            fn default() -> Self { Self { $( $field: $crate::params!(@default $kind $($ty)? $(= $default)?), )+ } }
        }
        impl $crate::param::Params for $name {
            const SPECS: &'static [$crate::param::ParamSpec] = {
                // One copy in the program; see `record!`.
                static TABLE: [$crate::param::ParamSpec; [ $( stringify!($field) ),+ ].len()] = [ $(
                    $crate::param::ParamSpec {
                        name: stringify!($field), symbol: $symbol,
                        unit: $crate::params!(@unit $($unit)?),
                        doc: concat!($($doc),+).trim_ascii(), source: $source,
                        kind: $crate::params!(@kind $kind $($ty)? $(= $default)? $(, $min, $max $(, $scale)?)?),
                    }
                ),+ ];
                &TABLE
            };
            fn get(&self, index: usize) -> $crate::param::ParamValue {
                [ $( $crate::params!(@get $kind self.$field) ),+ ][index]
            }
            fn put(&mut self, index: usize, value: $crate::param::ParamValue) {
                let mut next = 0;
                $( if index == next { $crate::params!(@put $kind $($ty)?, self.$field, value); } next += 1; )+
                let _ = next;
            }
        }
    };
    (@type number) => { f64 };
    (@type optional) => { f64 };
    (@type toggle) => { bool };
    (@type choice $ty:ident) => { $ty };
    (@default number = $d:expr) => { $d };
    (@default optional) => { f64::NAN };
    (@default toggle = $d:expr) => { $d };
    (@default choice $ty:ident) => { $ty::default() };
    (@unit) => { "1" };
    (@unit $unit:literal) => { $unit };
    (@kind number = $d:expr, $min:literal, $max:literal, $scale:ident) => {
        $crate::param::Kind::Number { default: $d, min: $min, max: $max, scale: $crate::param::Scale::$scale }
    };
    (@kind optional, $min:literal, $max:literal) => { $crate::param::Kind::Optional { min: $min, max: $max } };
    (@kind toggle = $d:expr) => { $crate::param::Kind::Toggle { default: $d } };
    (@kind choice $ty:ident) => { $crate::param::Kind::Choice {
        default: <$ty as $crate::param::Choice>::NAMES[0], options: <$ty as $crate::param::Choice>::NAMES } };
    (@get number $e:expr) => { $crate::param::ParamValue::Number($e) };
    (@get optional $e:expr) => { $crate::param::ParamValue::Number($e) };
    (@get toggle $e:expr) => { $crate::param::ParamValue::Toggle($e) };
    (@get choice $e:expr) => { $crate::param::ParamValue::Choice($crate::param::Choice::name($e)) };
    (@put number, $t:expr, $v:expr) => { if let $crate::param::ParamValue::Number(v) = $v { $t = v; } };
    (@put optional, $t:expr, $v:expr) => { if let $crate::param::ParamValue::Number(v) = $v { $t = v; } };
    (@put toggle, $t:expr, $v:expr) => { if let $crate::param::ParamValue::Toggle(v) = $v { $t = v; } };
    (@put choice $ty:ident, $t:expr, $v:expr) => {
        if let $crate::param::ParamValue::Choice(v) = $v
            && let Some(v) = <$ty as $crate::param::Choice>::from_name(v) { $t = v; }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    choice! {
        /// Which.
        enum Which {
            /// First.
            First = "first",
            /// Second.
            Second = "second",
        }
    }
    params! {
        /// Tuning.
        struct Tuning {
            /// Walk.
            walk ("q"): number = 0.1, "m/s", 0.01 ..= 1.0 Log, from "test";
            /// Yaw.
            yaw (""): optional, "rad", -4.0 ..= 4.0, from "test";
            /// Aid.
            aid (""): toggle = true, from "test";
            /// Which.
            which (""): choice Which, from "test";
        }
    }

    #[test]
    fn one_declaration_feeds_default_names_and_json() {
        let t = Tuning::default();
        assert_eq!(t.to_json(), json!({"walk": 0.1, "yaw": null, "aid": true, "which": "first"}));
        assert_eq!(Tuning::SPECS[0].unit, "m/s");
        assert_eq!(Tuning::from_json(&t.to_json()).unwrap().to_json(), t.to_json());
    }

    #[test]
    fn values_outside_their_kind_or_range_are_refused_with_a_sentence() {
        let error = |j: Value| Tuning::from_json(&j).unwrap_err().to_string();
        assert_eq!(error(json!({"q": 5.0})), "`walk` = 5 m/s is outside 0.01..=1");
        assert_eq!(error(json!({"wlak": 5.0})), "no parameter `wlak`; there are walk, yaw, aid, which");
        assert_eq!(error(json!({"which": "third"})), "`which` expects one of first, second, found \"third\"");
        assert_eq!(error(json!({"aid": 3})), "`aid` expects true or false, found 3");
        assert!(error(json!([1])).contains("JSON object"));
        assert!(Tuning { walk: f64::NAN, ..Tuning::default() }.validate().is_err(), "NaN is not a value of a number");
    }

    #[test]
    fn text_from_a_command_line_is_read_like_json() {
        let mut t = Tuning::default();
        t.set("walk", &json!("0.5")).unwrap();
        t.set("aid", &json!("false")).unwrap();
        t.set("yaw", &json!("auto")).unwrap();
        t.set("which", &json!("second")).unwrap();
        assert_eq!((t.walk, t.aid, t.which), (0.5, false, Which::Second));
        assert!(t.yaw.is_nan());
    }
}
