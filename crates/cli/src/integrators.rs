//! `steradian integrators`.

use integrators::IntegratorInfo;
use integrators::parameters::{ParameterInfo, ParameterKind};
use serde::Serialize;

use crate::args::IntegratorsArgs;
use crate::exit::{Done, Status};
use crate::messages::{self, say};

#[derive(Debug, Serialize)]
struct Report {
    integrators: Vec<Described>,
}

#[derive(Debug, Serialize)]
struct Described {
    name: &'static str,
    purpose: &'static str,
    misses: &'static str,
    unbiased: bool,
    parameters: Vec<Parameter>,
}

#[derive(Debug, Serialize)]
struct Parameter {
    name: &'static str,
    default: String,
    expected: String,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    choices: &'static [&'static str],
    doc: &'static str,
}

pub(crate) fn run(args: &IntegratorsArgs) -> Done {
    let described: Vec<Described> = integrators::list().iter().map(describe).collect();
    if args.json {
        messages::json(&Report { integrators: described });
        return Ok(Status::Done);
    }
    for (i, d) in described.iter().enumerate() {
        if i > 0 {
            say("");
        }
        let bias = if d.unbiased { "unbiased" } else { "biased" };
        say(&format!("{} ({bias}): {}", d.name, d.purpose));
        say(&format!("  misses: {}", d.misses));
        for p in &d.parameters {
            say(&format!("  {} = {}    {} ({})", p.name, p.default, p.doc, p.expected));
        }
    }
    Ok(Status::Done)
}

fn describe(info: &IntegratorInfo) -> Described {
    Described {
        name: info.name,
        purpose: info.purpose,
        misses: info.misses,
        unbiased: info.unbiased,
        parameters: (info.parameters)().iter().map(parameter).collect(),
    }
}

fn parameter(info: &ParameterInfo) -> Parameter {
    let choices = match &info.kind {
        ParameterKind::Choice(words) => *words,
        ParameterKind::Bool(_)
        | ParameterKind::Integer(_)
        | ParameterKind::Limit(_)
        | ParameterKind::Float(_)
        | ParameterKind::Counts(_)
        | ParameterKind::Text(_) => &[],
    };
    Parameter {
        name: info.name,
        default: info.kind.default_text(),
        expected: info.kind.expected(),
        choices,
        doc: info.doc,
    }
}
