//! The types of what scripts ask and are answered, as TypeScript: `assets/types.d.ts`, written by `scripts/generate`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::{Map, Value};

use crate::evolution::EvolutionNews;
use crate::items::ItemsNews;
use crate::run::RunNews;

const HEAD: &str =
    "// What the studio is asked and what it answers, from the types of the server by scripts/generate.\n";

/// Lists of routes, and what each is about.
const LISTS: [(&str, &str); 3] = [
    ("Gets", "What can be asked for: what the address says, and the answer."),
    ("Posts", "Changes: the body, and the answer."),
    ("Topics", "What pages listen to, and what they are sent."),
];

/// Schemas of what routes are asked and answer.
pub(super) struct Types {
    asked: SchemaGenerator,
    answers: SchemaGenerator,
    /// By list and path: what is asked, and the answer.
    routes: BTreeMap<(&'static str, String), (Option<Schema>, Schema)>,
}

impl Default for Types {
    fn default() -> Self {
        let settings = SchemaSettings::draft2020_12;
        Self {
            asked: settings().for_deserialize().into_generator(),
            answers: settings().for_serialize().into_generator(),
            routes: BTreeMap::new(),
        }
    }
}

impl Types {
    pub(super) fn add<Asked: JsonSchema, Answer: JsonSchema>(&mut self, list: &'static str, path: &str) {
        let schemas = (self.asked.subschema_for::<Asked>(), self.answers.subschema_for::<Answer>());
        self.routes.insert((list, path.trim_start_matches('/').to_owned()), (Some(schemas.0), schemas.1));
    }

    fn add_topic<News: JsonSchema>(&mut self, topic: &str) {
        let news = self.answers.subschema_for::<News>();
        self.routes.insert(("Topics", topic.to_owned()), (None, news));
    }

    fn into_typescript(mut self) -> String {
        let answers = self.answers.take_definitions(true);
        let asked = self.asked.take_definitions(true);
        let plain = Names::default();
        let other = Names(differing(&asked, &answers));
        let mut text = HEAD.to_owned();
        for (name, schema) in &answers {
            text += &plain.definition(name, schema);
        }
        for (name, schema) in
            asked.iter().filter(|(name, _)| !answers.contains_key(*name) || other.0.contains(*name))
        {
            text += &other.definition(name, schema);
        }
        for (list, about) in LISTS {
            write!(text, "\n/** {about} */\nexport interface {list} {{\n").unwrap();
            for ((_, path), (asked, answer)) in self.routes.iter().filter(|((own, _), _)| *own == list) {
                let answer = plain.typed(answer.as_value());
                let line = match asked.as_ref().map(|asked| other.typed(asked.as_value())) {
                    None => answer,
                    Some(asked) => {
                        let asked = if asked == "null" { "{}" } else { &asked };
                        format!("{{ asked: {asked}; answer: {answer} }}")
                    }
                };
                writeln!(text, "  {path:?}: {line};").unwrap();
            }
            text += "}\n";
        }
        text
    }
}

/// Types that are asked in another form than they are answered, as what has a default may be left out.
fn differing(asked: &Map<String, Value>, answers: &Map<String, Value>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    loop {
        let names =
            |schema: &Value| found.iter().any(|name| schema.to_string().contains(&format!("/{name}\"")));
        let differs = |(name, schema): &(&String, &Value)| {
            answers.get(*name).is_some_and(|answer| answer != *schema || names(schema))
        };
        let now: BTreeSet<String> = asked.iter().filter(differs).map(|(name, _)| name.clone()).collect();
        if now == found {
            return found;
        }
        found = now;
    }
}

/// Writes schemas; the names of these types get a prefix.
#[derive(Default)]
struct Names(BTreeSet<String>);

impl Names {
    fn of(&self, name: &str) -> String {
        if self.0.contains(name) { format!("Asked{name}") } else { name.to_owned() }
    }

    fn definition(&self, name: &str, schema: &Value) -> String {
        let (about, name) = (comment(schema, ""), self.of(name));
        match schema["properties"].as_object() {
            Some(fields) if schema.get("oneOf").is_none() => {
                let fields = fields.iter().map(|(key, field)| {
                    format!("{}  {};\n", comment(field, "  "), self.field(schema, key, field))
                });
                format!("\n{about}export interface {name} {{\n{}}}\n", fields.collect::<String>())
            }
            _ => format!("\n{about}export type {name} = {};\n", self.typed(schema)),
        }
    }

    fn field(&self, schema: &Value, key: &str, field: &Value) -> String {
        let is_needed = list(&schema["required"]).iter().any(|needed| needed == key);
        format!("{key}{}: {}", if is_needed { "" } else { "?" }, self.typed(field))
    }

    fn typed(&self, schema: &Value) -> String {
        if let Some(path) = schema["$ref"].as_str() {
            return self.of(path.rsplit('/').next().unwrap_or_default());
        }
        if let Some(value) = schema.get("const") {
            return value.to_string();
        }
        let all = ["oneOf", "anyOf"].iter().flat_map(|key| list(&schema[*key])).map(|one| self.typed(one));
        let mut all: Vec<String> = all.chain(list(&schema["enum"]).iter().map(Value::to_string)).collect();
        if all.is_empty() {
            all = match &schema["type"] {
                Value::Array(kinds) => kinds.iter().map(|kind| self.kind(kind, schema)).collect(),
                kind => vec![self.kind(kind, schema)],
            };
        }
        all.join(" | ")
    }

    fn kind(&self, kind: &Value, schema: &Value) -> String {
        match kind.as_str() {
            Some("integer" | "number") => "number".to_owned(),
            Some("array") => self.array(schema),
            Some("object") => match (schema["properties"].as_object(), schema.get("additionalProperties")) {
                (Some(fields), _) => {
                    let fields = fields.iter().map(|(key, field)| self.field(schema, key, field));
                    format!("{{ {} }}", fields.collect::<Vec<_>>().join("; "))
                }
                (None, Some(values @ Value::Object(_))) => format!("Record<string, {}>", self.typed(values)),
                (None, _) => "{}".to_owned(),
            },
            Some(plain @ ("string" | "boolean" | "null")) => plain.to_owned(),
            _ => "unknown".to_owned(),
        }
    }

    fn array(&self, schema: &Value) -> String {
        let parts = list(&schema["prefixItems"]);
        if !parts.is_empty() {
            // Those of a tuple struct are named before a colon.
            let part = |part: &Value| match part["description"].as_str() {
                Some(about) => format!("{}: {}", about.split(':').next().unwrap_or(about), self.typed(part)),
                None => self.typed(part),
            };
            return format!("[{}]", parts.iter().map(part).collect::<Vec<_>>().join(", "));
        }
        let item = self.typed(&schema["items"]);
        match schema["minItems"].as_u64().filter(|_| schema["minItems"] == schema["maxItems"]) {
            Some(count) => format!("[{}]", vec![item; count as usize].join(", ")),
            None if item.contains(' ') && !item.starts_with('[') => format!("({item})[]"),
            None => format!("{item}[]"),
        }
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// The first paragraph of a description.
fn comment(schema: &Value, indent: &str) -> String {
    let about = schema["description"].as_str().and_then(|text| text.split("\n\n").next());
    let about = about.map(|text| text.replace('\n', " ").replace("[`", "`").replace("`]", "`"));
    let about = about.map(|text| text.replace("`None`", "`null`"));
    about.map_or_else(String::new, |about| format!("{indent}/** {about} */\n"))
}

#[test]
fn types_of_scripts_are_current() {
    let mut types = super::routes().types;
    types.add_topic::<ItemsNews>("items");
    types.add_topic::<RunNews<'_>>("run");
    types.add_topic::<EvolutionNews>("evolution");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/types.d.ts");
    let text = types.into_typescript();
    if std::env::var_os("TROPISM_BLESS").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let is_current = std::fs::read_to_string(&path).is_ok_and(|found| found == text);
    assert!(is_current, "{} is not current, scripts/generate writes it", path.display());
}
