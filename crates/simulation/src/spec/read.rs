//! From JSON to the fields of a drive: one small reader, where a derived one for each type would fill a tenth of the
//! page's core.

use drivescope_drive::json::named;
use serde_json::Value;

use super::error::SpecError;
use super::options::Changes;

/// What is wrong and where, from the inside out.
pub(super) struct Trouble {
    path: String,
    what: String,
}

impl Trouble {
    #[cold]
    fn new(what: String) -> Self {
        Self { path: String::new(), what }
    }

    #[cold]
    fn inside(mut self, step: &str) -> Self {
        let dot = if self.path.is_empty() || self.path.starts_with('[') { "" } else { "." };
        self.path = [step, dot, &self.path].concat();
        self
    }
}

impl From<Trouble> for SpecError {
    fn from(trouble: Trouble) -> Self {
        let colon = if trouble.path.is_empty() { "" } else { ": " };
        Self::Json([&trouble.path, colon, &trouble.what].concat())
    }
}

/// Anything that a drive's JSON holds.
pub(super) trait Read: Sized {
    fn read(value: &Value) -> Result<Self, Trouble>;
}

#[cold]
#[inline(never)]
fn wrong(expected: &str, found: &Value) -> Trouble {
    Trouble::new(["expected ", expected, ", found ", &named(found)].concat())
}

/// Hand every field of an object to `put`, which says whether it knows it; refuse the others and missing ones.
pub(super) fn fields(
    value: &Value,
    names: &[&str],
    required: &[&str],
    put: &mut dyn FnMut(usize, &Value) -> Result<(), Trouble>,
) -> Result<(), Trouble> {
    let object = value.as_object().ok_or_else(|| wrong("an object", value))?;
    for (key, value) in object {
        let Some(index) = names.iter().position(|n| n == key) else {
            let known = names.join("`, `");
            return Err(Trouble::new(["unknown field `", key, "`, expected one of `", &known, "`"].concat()));
        };
        put(index, value).map_err(|e| e.inside(key))?;
    }
    match required.iter().find(|name| !object.contains_key(**name)) {
        Some(missing) => Err(Trouble::new(["missing field `", missing, "`"].concat())),
        None => Ok(()),
    }
}

/// Which of the names a value is.
pub(super) fn choice(value: &Value, names: &[&str]) -> Result<usize, Trouble> {
    let found = value.as_str().and_then(|text| names.iter().position(|n| *n == text));
    found.ok_or_else(|| wrong(&["one of `", &names.join("`, `"), "`"].concat(), value))
}

#[inline(never)]
fn list<T: Read>(value: &Value) -> Result<Vec<T>, Trouble> {
    let entries = value.as_array().ok_or_else(|| wrong("a list", value))?;
    let mut all = Vec::with_capacity(entries.len());
    for (index, entry) in entries.iter().enumerate() {
        all.push(T::read(entry).map_err(|e| e.inside(&["[", &index.to_string(), "]"].concat()))?);
    }
    Ok(all)
}

impl Read for f64 {
    #[inline(never)]
    fn read(value: &Value) -> Result<Self, Trouble> {
        value.as_f64().ok_or_else(|| wrong("a number", value))
    }
}

impl Read for u64 {
    #[inline(never)]
    fn read(value: &Value) -> Result<Self, Trouble> {
        value.as_u64().ok_or_else(|| wrong("a whole number", value))
    }
}

impl Read for usize {
    fn read(value: &Value) -> Result<Self, Trouble> {
        u64::read(value).map(|n| n.min(u64::from(u32::MAX)) as Self)
    }
}

impl Read for bool {
    #[inline(never)]
    fn read(value: &Value) -> Result<Self, Trouble> {
        value.as_bool().ok_or_else(|| wrong("true or false", value))
    }
}

impl Read for String {
    #[inline(never)]
    fn read(value: &Value) -> Result<Self, Trouble> {
        value.as_str().map(Self::from).ok_or_else(|| wrong("a text", value))
    }
}

impl<T: Read> Read for Option<T> {
    fn read(value: &Value) -> Result<Self, Trouble> {
        if value.is_null() { Ok(None) } else { T::read(value).map(Some) }
    }
}

impl<T: Read> Read for Vec<T> {
    fn read(value: &Value) -> Result<Self, Trouble> {
        list(value)
    }
}

impl<T: Read> Read for [T; 3] {
    fn read(value: &Value) -> Result<Self, Trouble> {
        list(value)?.try_into().map_err(|_| wrong("three entries", value))
    }
}

impl Read for Changes {
    fn read(value: &Value) -> Result<Self, Trouble> {
        let object = value.as_object().ok_or_else(|| wrong("an object", value))?;
        let mut all = Vec::new();
        for (key, value) in object {
            all.push((key.clone(), f64::read(value).map_err(|e| e.inside(key))?));
        }
        Ok(Self(all))
    }
}

/// Make a struct readable: its value without any field, its fields, and those that may not be missing.
macro_rules! readable {
    ($name:ty, $blank:expr, [$($field:ident),+], [$($required:literal),*]) => {
        impl $crate::spec::read::Read for $name {
            fn read(value: &serde_json::Value) -> Result<Self, $crate::spec::read::Trouble> {
                const NAMES: &[&str] = &[$(stringify!($field)),+];
                let mut out: $name = $blank;
                $crate::spec::read::fields(value, NAMES, &[$($required),*], &mut |index, value| {
                    let mut at = 0..;
                    $(if at.next() == Some(index) { out.$field = $crate::spec::read::Read::read(value)?; return Ok(()); })+
                    Ok(())
                })?;
                Ok(out)
            }
        }
    };
}

/// Make an enum readable: its names in files and what they mean.
macro_rules! nameable {
    ($name:ty, [$($text:literal => $value:expr),+ $(,)?]) => {
        impl $crate::spec::read::Read for $name {
            fn read(value: &serde_json::Value) -> Result<Self, $crate::spec::read::Trouble> {
                const VALUES: &[$name] = &[$($value),+];
                $crate::spec::read::choice(value, &[$($text),+]).map(|index| VALUES[index])
            }
        }
    };
}

pub(super) use {nameable, readable};
