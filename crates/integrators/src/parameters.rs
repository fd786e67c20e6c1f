//! Parameters of integrators: names, kinds, defaults, and reading them from text.

use std::collections::BTreeMap;

use scene_desc::ParameterValue;
use thiserror::Error;

/// One parameter, as `steradian integrators` shows it.
#[derive(Clone, Debug)]
pub struct ParameterInfo {
    /// Its name.
    pub name: &'static str,
    /// What it takes, and what it is if not given.
    pub kind: ParameterKind,
    /// What it does.
    pub doc: &'static str,
}

/// What a parameter takes, with its default.
#[derive(Clone, Debug)]
pub enum ParameterKind {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number, at least zero.
    Integer(i64),
    /// A whole number, or `none` for no limit.
    Limit(Option<i64>),
    /// A number.
    Float(f64),
    /// One of these words; the first is the default.
    Choice(&'static [&'static str]),
    /// Whole numbers from 1 on, with commas between them.
    Counts(&'static str),
    /// Free text.
    Text(&'static str),
}

/// Parameters that several integrators have.
pub(crate) mod shared {
    use sampling::mis::Heuristic;

    use super::{ParameterInfo, ParameterKind, Parameters};

    pub(crate) const MAX_DEPTH: ParameterInfo = ParameterInfo {
        name: "max_depth",
        kind: ParameterKind::Limit(Some(5)),
        doc: "most scattering events of a path; 0 shows emitters only, 1 direct light",
    };

    pub(crate) const RR_DEPTH: ParameterInfo = ParameterInfo {
        name: "rr_depth",
        kind: ParameterKind::Integer(3),
        doc: "scattering events of a walk before Russian roulette may end it",
    };

    pub(crate) const HEURISTIC: ParameterInfo = ParameterInfo {
        name: "heuristic",
        kind: ParameterKind::Choice(&["power", "balance"]),
        doc: "how the weights of competing techniques follow from their densities",
    };

    /// What [`HEURISTIC`] was set to.
    pub(crate) fn heuristic(p: &Parameters) -> Heuristic {
        if p.text(HEURISTIC.name) == "balance" { Heuristic::Balance } else { Heuristic::Power }
    }
}

/// Why a parameter was not taken.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ParameterError {
    /// No such parameter.
    #[error("integrator `{integrator}` has no parameter `{name}`; it has {known}")]
    Unknown {
        /// Of which integrator.
        integrator: String,
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// Not of its kind.
    #[error("parameter `{name}` of `{integrator}` cannot be `{value}`: expected {expected}")]
    Value {
        /// Of which integrator.
        integrator: String,
        /// Which.
        name: String,
        /// What was given.
        value: String,
        /// What it takes.
        expected: String,
    },
    /// The scene has something that the integrator cannot render.
    #[error("integrator `{integrator}` cannot render this scene: {reason}")]
    Refused {
        /// Which.
        integrator: String,
        /// What, and which integrators can.
        reason: &'static str,
    },
    /// No such integrator.
    #[error("there is no integrator `{name}`; there are {known}")]
    NoIntegrator {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
}

/// Checked values of an integrator's parameters: every one has a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    values: BTreeMap<&'static str, Value>,
}

#[derive(Clone, Debug, PartialEq)]
enum Value {
    Bool(bool),
    Integer(i64),
    Limit(Option<i64>),
    Float(f64),
    Text(String),
}

impl Parameters {
    /// The defaults of `infos`, replaced by what `given` says, in order; a later one wins.
    ///
    /// # Errors
    /// A name that is not there, or a value not of its kind.
    pub fn new<'a>(
        integrator: &str,
        infos: &[ParameterInfo],
        given: impl IntoIterator<Item = (&'a str, &'a ParameterValue)>,
    ) -> Result<Self, ParameterError> {
        let mut values: BTreeMap<_, _> = infos.iter().map(|i| (i.name, i.kind.default_value())).collect();
        for (name, value) in given {
            let info = infos.iter().find(|i| i.name == name).ok_or_else(|| ParameterError::Unknown {
                integrator: integrator.to_owned(),
                name: name.to_owned(),
                known: infos.iter().map(|i| i.name).collect::<Vec<_>>().join(", "),
            })?;
            let read = info.kind.read(value).ok_or_else(|| ParameterError::Value {
                integrator: integrator.to_owned(),
                name: name.to_owned(),
                value: display(value),
                expected: info.kind.expected(),
            })?;
            values.insert(info.name, read);
        }
        Ok(Self { values })
    }

    /// A yes-or-no parameter; false if it is of another kind (a bug).
    #[must_use]
    pub fn bool(&self, name: &str) -> bool {
        matches!(self.values.get(name), Some(Value::Bool(true)))
    }

    /// A whole number.
    #[must_use]
    pub fn integer(&self, name: &str) -> u32 {
        match self.values.get(name) {
            Some(Value::Integer(i)) => u32::try_from(*i).unwrap_or(u32::MAX),
            other => unreachable_kind(name, other),
        }
    }

    /// A limit: `u32::MAX` for none.
    #[must_use]
    pub fn limit(&self, name: &str) -> u32 {
        match self.values.get(name) {
            Some(Value::Limit(i)) => i.map_or(u32::MAX, |i| u32::try_from(i).unwrap_or(u32::MAX)),
            other => unreachable_kind(name, other),
        }
    }

    /// A number.
    #[must_use]
    pub fn float(&self, name: &str) -> f32 {
        match self.values.get(name) {
            Some(Value::Float(x)) => *x as f32,
            other => unreachable_kind(name, other) as f32,
        }
    }

    /// A word.
    #[must_use]
    pub fn text(&self, name: &str) -> &str {
        match self.values.get(name) {
            Some(Value::Text(s)) => s,
            _ => "",
        }
    }

    /// Numbers from 1 on, at least one.
    #[must_use]
    pub fn counts(&self, name: &str) -> Vec<u32> {
        counts(self.text(name)).unwrap_or_else(|| vec![1])
    }

    /// All as `name=value`, sorted: part of what makes two renders the same.
    #[must_use]
    pub fn canonical(&self) -> String {
        let show = |v: &Value| match v {
            Value::Bool(b) => b.to_string(),
            Value::Integer(i) | Value::Limit(Some(i)) => i.to_string(),
            Value::Limit(None) => "none".to_owned(),
            Value::Float(x) => x.to_string(),
            Value::Text(s) => s.clone(),
        };
        self.values.iter().map(|(k, v)| format!("{k}={}", show(v))).collect::<Vec<_>>().join(" ")
    }
}

/// Numbers from 1 on with commas between them; `None` if the text is not that.
fn counts(text: &str) -> Option<Vec<u32>> {
    text.split(',').map(|s| s.trim().parse().ok().filter(|n| *n > 0)).collect()
}

fn unreachable_kind(name: &str, value: Option<&Value>) -> u32 {
    debug_assert!(false, "parameter {name} asked for as another kind than {value:?}");
    0
}

fn display(value: &ParameterValue) -> String {
    match value {
        ParameterValue::Bool(b) => b.to_string(),
        ParameterValue::Integer(i) => i.to_string(),
        ParameterValue::Float(x) => x.to_string(),
        ParameterValue::Text(s) => s.clone(),
    }
}

impl ParameterKind {
    fn default_value(&self) -> Value {
        match self {
            Self::Bool(b) => Value::Bool(*b),
            Self::Integer(i) => Value::Integer(*i),
            Self::Limit(i) => Value::Limit(*i),
            Self::Float(x) => Value::Float(*x),
            Self::Choice(words) => Value::Text((*words.first().unwrap_or(&"")).to_owned()),
            Self::Counts(s) | Self::Text(s) => Value::Text((*s).to_owned()),
        }
    }

    fn read(&self, value: &ParameterValue) -> Option<Value> {
        let text = display(value);
        match self {
            Self::Bool(_) => match text.as_str() {
                "true" | "yes" | "on" | "1" => Some(Value::Bool(true)),
                "false" | "no" | "off" | "0" => Some(Value::Bool(false)),
                _ => None,
            },
            Self::Integer(_) => text.parse().ok().filter(|i| *i >= 0).map(Value::Integer),
            Self::Limit(_) if matches!(text.as_str(), "none" | "unlimited" | "inf" | "-1") => {
                Some(Value::Limit(None))
            }
            Self::Limit(_) => text.parse().ok().filter(|i| *i >= 0).map(|i| Value::Limit(Some(i))),
            Self::Float(_) => text.parse().ok().filter(|x: &f64| x.is_finite()).map(Value::Float),
            Self::Choice(words) => words.contains(&text.as_str()).then_some(Value::Text(text)),
            Self::Counts(_) => counts(&text).map(|_| Value::Text(text)),
            Self::Text(_) => Some(Value::Text(text)),
        }
    }

    /// What it takes, in words.
    #[must_use]
    pub fn expected(&self) -> String {
        match self {
            Self::Bool(_) => "true or false".to_owned(),
            Self::Integer(_) => "a whole number".to_owned(),
            Self::Limit(_) => "a whole number, or none".to_owned(),
            Self::Float(_) => "a number".to_owned(),
            Self::Choice(words) => format!("one of {}", words.join(", ")),
            Self::Counts(_) => "whole numbers from 1 on, such as 4,2,1".to_owned(),
            Self::Text(_) => "text".to_owned(),
        }
    }

    /// The default, in words.
    #[must_use]
    pub fn default_text(&self) -> String {
        match self {
            Self::Bool(b) => b.to_string(),
            Self::Integer(i) | Self::Limit(Some(i)) => i.to_string(),
            Self::Limit(None) => "none".to_owned(),
            Self::Float(x) => x.to_string(),
            Self::Choice(words) => (*words.first().unwrap_or(&"")).to_owned(),
            Self::Counts(s) | Self::Text(s) => (*s).to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INFOS: [ParameterInfo; 2] = [
        ParameterInfo { name: "max_depth", kind: ParameterKind::Limit(Some(5)), doc: "" },
        ParameterInfo { name: "sampling", kind: ParameterKind::Choice(&["bsdf", "cosine"]), doc: "" },
    ];

    fn text(s: &str) -> ParameterValue {
        ParameterValue::Text(s.to_owned())
    }

    #[test]
    fn counts_are_whole_numbers_from_one() {
        assert_eq!(counts("4, 2,1"), Some(vec![4, 2, 1]));
        assert_eq!(counts("7"), Some(vec![7]));
        for bad in ["", "4,,1", "0", "2,0", "-1", "a", "4 2", "99999999999"] {
            assert_eq!(counts(bad), None, "{bad}");
        }
    }

    #[test]
    fn defaults_stand_until_something_is_given() {
        let p = Parameters::new("path", &INFOS, [("max_depth", &text("none"))]).unwrap();
        assert_eq!((p.limit("max_depth"), p.text("sampling")), (u32::MAX, "bsdf"));
        assert_eq!(p.canonical(), "max_depth=none sampling=bsdf");
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        let e = Parameters::new("path", &INFOS, [("depth", &text("3"))]).unwrap_err();
        assert_eq!(e.to_string(), "integrator `path` has no parameter `depth`; it has max_depth, sampling");
        assert!(Parameters::new("path", &INFOS, [("sampling", &text("light"))]).is_err());
    }
}
