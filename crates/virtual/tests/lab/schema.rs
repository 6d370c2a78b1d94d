//! As much of JSON Schema 2020-12 as the lab's schema uses.

use serde_json::Value;

/// Why a value is not as the schema says; none if it is.
pub(crate) fn mismatch(value: &Value, schema: &Value, root: &Value) -> Option<String> {
    let Value::Object(rules) = schema else { panic!("a schema is an object: {schema}") };
    rules.iter().find_map(|(rule, wanted)| match rule.as_str() {
        "$schema" | "$defs" | "title" | "description" => None,
        "$ref" => {
            let path = wanted.as_str().unwrap().strip_prefix('#').unwrap();
            mismatch(value, root.pointer(path).expect(path), root)
        }
        "anyOf" => {
            let reasons: Option<Vec<String>> =
                array(wanted).iter().map(|schema| mismatch(value, schema, root)).collect();
            reasons.map(|reasons| reasons.join("\n"))
        }
        "const" => (value != wanted).then(|| format!("{value} is not {wanted}")),
        "enum" => (!array(wanted).contains(value)).then(|| format!("{value} is not in {wanted}")),
        "type" => {
            let types = match wanted {
                Value::Array(types) => types.clone(),
                one => vec![one.clone()],
            };
            (!types.iter().any(|name| is_a(value, name.as_str().unwrap())))
                .then(|| format!("{value} is no {wanted}"))
        }
        "required" => array(wanted)
            .iter()
            .find(|key| value.get(key.as_str().unwrap()).is_none())
            .map(|key| format!("{key} is missing")),
        "properties" => members(wanted).find_map(|(key, schema)| {
            mismatch(value.get(key)?, schema, root).map(|reason| format!("{key}: {reason}"))
        }),
        "additionalProperties" => members(value).find_map(|(key, value)| {
            if rules.get("properties").is_some_and(|known| known.get(key).is_some()) {
                return None;
            }
            match wanted {
                Value::Bool(true) => None,
                Value::Bool(false) => Some(format!("{key} is not known")),
                schema => mismatch(value, schema, root).map(|reason| format!("{key}: {reason}")),
            }
        }),
        "items" => array(value).iter().find_map(|item| mismatch(item, wanted, root)),
        rule => panic!("the tests know nothing of {rule}"),
    })
}

fn is_a(value: &Value, name: &str) -> bool {
    match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "null" => value.is_null(),
        name => panic!("{name} is no type"),
    }
}

fn array(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn members(value: &Value) -> impl Iterator<Item = (&String, &Value)> {
    value.as_object().into_iter().flatten()
}
