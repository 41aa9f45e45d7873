//! Holds numbers against the ranges of their own JSON Schema, so that a configuration which reaches the
//! module without the scene reader is refused in the same places.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::ConfigError;

/// The first value of `config` that lies outside of its schema's range, length or pattern of keys.
pub fn check<T: JsonSchema + Serialize>(config: &T) -> Result<(), ConfigError> {
    let schema = schemars::schema_for!(T).to_value();
    let value = serde_json::to_value(config)
        .map_err(|error| ConfigError::new("", format!("cannot be read back: {error}")))?;
    walk(&schema, &schema, &value, "", 0)
}

fn walk(root: &Value, schema: &Value, value: &Value, path: &str, depth: usize) -> Result<(), ConfigError> {
    // Schemas made from types that hold no box of themselves end long before.
    if depth > 32 {
        return Ok(());
    }
    let reference = schema.get("$ref").and_then(Value::as_str).and_then(|r| r.strip_prefix('#'));
    if let Some(target) = reference.and_then(|target| root.pointer(target)) {
        walk(root, target, value, path, depth + 1)?;
    }
    for choice in schema.get("anyOf").and_then(Value::as_array).into_iter().flatten() {
        if choice.get("$ref").is_some() && !value.is_null() {
            walk(root, choice, value, path, depth + 1)?;
        }
    }
    let refuse = |problem: String| Err(ConfigError::new(path, problem));
    match value {
        Value::Number(number) => {
            let number = number.as_f64().unwrap_or(f64::NAN);
            let limit = |key: &str| schema.get(key).and_then(Value::as_f64);
            if limit("minimum").is_some_and(|least| number < least) {
                return refuse(format!("must be at least {}, is {number}", limit("minimum").unwrap_or(0.0)));
            }
            if limit("maximum").is_some_and(|most| number > most) {
                return refuse(format!("must be at most {}, is {number}", limit("maximum").unwrap_or(0.0)));
            }
            if limit("exclusiveMinimum").is_some_and(|least| number <= least) {
                return refuse(format!(
                    "must be above {}, is {number}",
                    limit("exclusiveMinimum").unwrap_or(0.0)
                ));
            }
        }
        Value::Array(elements) => {
            let most = schema.get("maxItems").and_then(Value::as_u64).unwrap_or(u64::MAX);
            if elements.len() as u64 > most {
                return refuse(format!("has {} elements; the limit is {most}", elements.len()));
            }
            if let Some(items) = schema.get("items") {
                for (i, element) in elements.iter().enumerate() {
                    walk(root, items, element, &format!("{path}[{i}]"), depth + 1)?;
                }
            }
        }
        Value::Object(entries) => {
            for (key, value) in entries {
                if let Some(schema) = schema.get("properties").and_then(|all| all.get(key)) {
                    let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                    walk(root, schema, value, &path, depth + 1)?;
                }
            }
        }
        _ => {}
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Serialize, JsonSchema)]
    struct Grid {
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        stiffness: f64,
        #[schemars(inner(range(min = 0.0)))]
        radius: [f64; 2],
        #[schemars(range(min = 2, max = 256))]
        nodes: u32,
    }

    #[derive(Serialize, JsonSchema)]
    struct Config {
        fibres: Vec<Grid>,
    }

    #[test]
    fn numbers_out_of_range_are_named_by_their_path() {
        let good = Grid { stiffness: 1.0, radius: [0.1, 0.1], nodes: 10 };
        let grid = |grid: Grid| check(&Config { fibres: vec![good.clone(), grid] });
        assert_eq!(grid(good.clone()), Ok(()));
        let error = grid(Grid { stiffness: 0.0, ..good.clone() }).unwrap_err();
        assert_eq!(error.to_string(), "fibres[1].stiffness: must be above 0, is 0");
        let error = grid(Grid { radius: [0.1, -1.0], ..good.clone() }).unwrap_err();
        assert_eq!(error.path, "fibres[1].radius[1]");
        let error = grid(Grid { nodes: 257, ..good.clone() }).unwrap_err();
        assert_eq!(error.to_string(), "fibres[1].nodes: must be at most 256, is 257");
    }
}
