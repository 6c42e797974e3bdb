//! JSON values in sentences and file headers, without JSON's own writer, which would link its tables of numbers.

use serde_json::Value;

/// A value as a sentence names it: a list or an object by its kind alone.
pub fn named(value: &Value) -> String {
    match value {
        Value::Null => "null".into(),
        Value::Bool(is_true) => is_true.to_string(),
        Value::Number(number) => number.as_f64().unwrap_or(f64::NAN).to_string(),
        Value::String(text) => ["\"", text, "\""].concat(),
        Value::Array(_) => "a list".into(),
        Value::Object(_) => "an object".into(),
    }
}

/// An object of plain names and scalars, as JSON text.
pub fn flat(object: &Value) -> String {
    let entries = object.as_object().into_iter().flatten();
    let entries: Vec<String> = entries.map(|(name, value)| ["\"", name, "\":", &named(value)].concat()).collect();
    ["{", &entries.join(","), "}"].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn scalars_are_named_as_they_are_written_and_the_rest_by_kind() {
        let said = [json!(null), json!(true), json!(3), json!(-0.25), json!("a"), json!([1]), json!({"a": 1})];
        assert_eq!(said.map(|v| named(&v)), ["null", "true", "3", "-0.25", "\"a\"", "a list", "an object"]);
    }

    #[test]
    fn a_flat_object_is_read_as_what_it_was() {
        let object = json!({"mass": 1234.5, "small": -0.00042, "on": false, "none": null, "which": "a"});
        assert_eq!(serde_json::from_str::<Value>(&flat(&object)).unwrap(), object);
        assert_eq!(flat(&json!({})), "{}");
    }
}
