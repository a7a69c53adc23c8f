//! The JSON schemas in `schemas/`, and the tables of keys in `docs/reference/`, are those of the types.
//!
//! `scripts/generate` writes both.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde_json::Value;
use tropism::task::Task;
use tropism::vision::Calibration;
use tropism_bean::Species;
use tropism_lab::evolve::EvolveConfig;
use tropism_lab::replicates::ReplicatesConfig;
use tropism_lab::study::StudyConfig;
use tropism_lab::sweep::SweepConfig;
use tropism_lab::wall::{WallFile, WallStudyConfig};
use tropism_rig::file::RigFile;

/// Where a table of keys begins in a page, after its schema and its type: `<!-- keys: rig LedsLamp -->`.
const BEGIN: &str = "<!-- keys: ";
const END: &str = "<!-- end of keys -->";

/// Each schema by the name of its file.
fn schemas() -> BTreeMap<&'static str, Value> {
    BTreeMap::from([
        ("bean", schema::<Species>()),
        ("calibration", schema::<Calibration>()),
        ("evolution", schema::<EvolveConfig>()),
        ("replicates", schema::<ReplicatesConfig>()),
        ("rig", schema::<RigFile>()),
        ("study", schema::<StudyConfig>()),
        ("sweep", schema::<SweepConfig>()),
        ("task", schema::<Task>()),
        ("wall", schema::<WallFile>()),
        ("walls", schema::<WallStudyConfig>()),
    ])
}

fn schema<T: JsonSchema>() -> Value {
    let mut schema: Schema = SchemaSettings::default().into_generator().into_root_schema_for::<T>();
    // TOML has no null: a key without a value is left out.
    let mut value = schema.ensure_object().clone().into();
    tidy(&mut value);
    value
}

/// Takes what only Rust has out of a schema: links in descriptions, null, and formats of numbers.
fn tidy(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.remove("format");
            // The defaults of a table stand at its keys.
            if map.get("default").is_some_and(|default| default.is_null() || default.is_object()) {
                map.remove("default");
            }
            if let Some(Value::String(text)) = map.get_mut("description") {
                *text = plain(text);
            }
            let is_null =
                |schema: &Value| schema == "null" || schema.get("type").is_some_and(|kind| kind == "null");
            for key in ["type", "anyOf", "enum"] {
                if let Some(Value::Array(any)) = map.get_mut(key) {
                    any.retain(|schema| !is_null(schema) && !schema.is_null());
                    if let ("type", [only]) = (key, &any[..]) {
                        map["type"] = only.clone();
                    }
                }
            }
            if let Some(Value::Array(any)) = map.get("anyOf")
                && let [Value::Object(only)] = &any[..]
            {
                let only = only.clone();
                map.remove("anyOf");
                for (key, value) in only {
                    map.entry(key).or_insert(value);
                }
            }
            map.values_mut().for_each(tidy);
        }
        Value::Array(values) => values.iter_mut().for_each(tidy),
        _ => {}
    }
}

/// A doc comment as plain text: its first paragraph, on one line, without links.
fn plain(text: &str) -> String {
    let text = text.split("\n\n").next().unwrap_or_default();
    let text: Vec<&str> = text.lines().map(str::trim).collect();
    let mut rest = &text.join(" ")[..];
    let mut plain = String::new();
    while let Some((before, link)) = rest.split_once('[') {
        let end = link.find(']');
        let target = end.map(|end| &link[end + 1..]).filter(|after| after.starts_with('('));
        match (end, target.and_then(|target| target.find(')'))) {
            (Some(end), Some(close)) => {
                write!(plain, "{before}{}", &link[..end]).unwrap();
                rest = &link[end + close + 2..];
            }
            (Some(end), None) if link.starts_with('`') => {
                write!(plain, "{before}{}", &link[..end]).unwrap();
                rest = &link[end + 1..];
            }
            _ => {
                write!(plain, "{before}[").unwrap();
                rest = link;
            }
        }
    }
    plain + rest
}

/// A type of a schema, or one of its kinds: `RigFile`, `CameraDriver.rpicam`.
fn named<'s>(schema: &'s Value, name: &str) -> &'s Value {
    let (of_type, kind) = name.split_once('.').map_or((name, None), |(of_type, kind)| (of_type, Some(kind)));
    let found = schema["$defs"].get(of_type).or_else(|| (schema["title"] == of_type).then_some(schema));
    let found = found.unwrap_or_else(|| panic!("no type {name} in the schema of {}", schema["title"]));
    let Some(kind) = kind else { return found };
    let kinds = found["oneOf"].as_array().into_iter().flatten();
    let is_it = |one: &&Value| ["driver", "kind"].iter().any(|key| one["properties"][key]["const"] == kind);
    kinds.into_iter().find(is_it).unwrap_or_else(|| panic!("no kind {name}"))
}

/// The rows of a type: key, type, default, meaning; those that a file must have first. Where a type has kinds, each key names
/// those that take it.
fn table(schema: &Value, name: &str) -> String {
    let of_type = named(schema, name);
    let kinds = match of_type["oneOf"].as_array() {
        Some(kinds) => kinds.iter().collect(),
        None => vec![of_type],
    };
    let mut rows: BTreeMap<(bool, &String), (&Value, Vec<String>)> = BTreeMap::new();
    for kind in &kinds {
        let required =
            |key: &str| kind["required"].as_array().is_some_and(|keys| keys.iter().any(|name| name == key));
        for (key, value) in kind["properties"].as_object().into_iter().flatten() {
            // The word that chooses the kind stands in the text.
            if !(value.get("const").is_some() && matches!(&key[..], "driver" | "kind")) {
                let row = rows.entry((!required(key), key)).or_insert_with(|| (value, Vec::new()));
                row.1.extend(kind["title"].as_str().map(|title| format!("`{title}`")));
            }
        }
    }
    let has_kinds = kinds.len() > 1;
    let mut text = match has_kinds {
        true => "| key | type | default | | `kind` |\n|---|---|---|---|---|\n".to_owned(),
        false => "| key | type | default | |\n|---|---|---|---|\n".to_owned(),
    };
    for ((_, key), (value, of_kinds)) in rows {
        let defaults =
            kinds.iter().filter_map(|kind| kind["properties"].get(key)).map(|value| &value["default"]);
        let default = match &value["default"] {
            Value::Null => String::new(),
            Value::Array(values) if values.iter().any(Value::is_object) => String::new(),
            default if defaults.clone().any(|other| other != default) => "that of the kind".to_owned(),
            default => format!("`{default}`"),
        };
        let described = value["description"].as_str().or(resolved(schema, value)["description"].as_str());
        let meaning = described.unwrap_or_default().replace('|', "\\|");
        write!(text, "| `{key}` | {} | {default} | {meaning} |", type_of(schema, value)).unwrap();
        match has_kinds {
            true if of_kinds.len() == kinds.len() => writeln!(text, " all |"),
            true => writeln!(text, " {} |", of_kinds.join(", ")),
            false => writeln!(text),
        }
        .unwrap();
    }
    text
}

fn resolved<'s>(schema: &'s Value, value: &'s Value) -> &'s Value {
    let name = value["$ref"].as_str().and_then(|to| to.strip_prefix("#/$defs/"));
    name.map_or(value, |name| &schema["$defs"][name])
}

/// The type of a value in a few words.
fn type_of(schema: &Value, value: &Value) -> String {
    let found = resolved(schema, value);
    let choices = |any: &[Value]| {
        let mut words: Vec<String> = any.iter().map(|one| type_of(schema, one)).collect();
        words.dedup();
        words.join(" or ")
    };
    if let Some(word) = found.get("const") {
        return format!("`{word}`");
    }
    if let Some(Value::Array(words)) = found.get("enum") {
        let words: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
        return words.join(", ");
    }
    for key in ["oneOf", "anyOf"] {
        if let Some(Value::Array(any)) = found.get(key) {
            return choices(any);
        }
    }
    match found["type"].as_str().unwrap_or("any") {
        "string" => "text".to_owned(),
        "boolean" => "true or false".to_owned(),
        "integer" => "whole number".to_owned(),
        "object" => "table".to_owned(),
        "array" => {
            let of = found.get("items").or_else(|| found["prefixItems"].get(0));
            let of = of.map_or_else(String::new, |items| format!(" of {}", type_of(schema, items)));
            match found["minItems"].as_u64().filter(|_| found["minItems"] == found["maxItems"]) {
                Some(count) => format!("list{of}, {count} values"),
                None => format!("list{of}"),
            }
        }
        other => other.to_owned(),
    }
}

/// A page with its tables of keys written anew.
fn page(schemas: &BTreeMap<&'static str, Value>, text: &str) -> String {
    let mut written = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (name, after) = after.split_once(" -->").expect("a table of keys has a name");
        let (_, after) = after.split_once(END).expect("a table of keys ends");
        let (file, kind) = name.split_once(' ').expect("a schema and a type");
        write!(written, "{before}{BEGIN}{name} -->\n{}{END}", table(&schemas[file], kind)).unwrap();
        rest = after;
    }
    written + rest
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Compares a file with what it should hold, or writes it.
fn hold(path: &Path, text: &str) -> bool {
    let is_current = std::fs::read_to_string(path).is_ok_and(|found| found == text);
    if !is_current && std::env::var_os("TROPISM_BLESS").is_some() {
        std::fs::write(path, text).unwrap();
        return true;
    }
    is_current
}

#[test]
fn schemas_and_tables_of_keys_are_current() {
    let schemas = schemas();
    let mut stale = Vec::new();
    let root = root();
    for (name, schema) in &schemas {
        let text = serde_json::to_string_pretty(schema).unwrap() + "\n";
        stale.extend(
            (!hold(&root.join(format!("schemas/{name}.json")), &text))
                .then(|| format!("schemas/{name}.json")),
        );
    }
    for file in std::fs::read_dir(root.join("docs/reference")).unwrap() {
        let path = file.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        stale.extend((!hold(&path, &page(&schemas, &text))).then(|| path.display().to_string()));
    }
    assert!(stale.is_empty(), "not current, scripts/generate writes them: {}", stale.join(", "));
}
