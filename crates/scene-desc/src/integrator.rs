//! How the file wants to be rendered; the command line may say otherwise.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Span;

/// The method that a file asks for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct IntegratorDesc {
    /// Our name of it (`path` for pbrt's `volpath`).
    pub name: String,
    /// Most scattering events of a path; `None`: no limit.
    pub max_depth: Option<u32>,
    /// Russian roulette starts after this many events; `None`: the integrator's default.
    pub rr_depth: Option<u32>,
    /// How a light is chosen.
    pub light_selection: LightSelection,
    /// What else the file says, by our parameter names.
    pub parameters: BTreeMap<String, ParameterValue>,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// A parameter of an integrator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ParameterValue {
    /// Yes or no.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Float(f64),
    /// A word.
    Text(String),
}

/// How next-event estimation chooses a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightSelection {
    /// All alike.
    Uniform,
    /// By power.
    Power,
    /// By what it may send to the point (a light tree).
    #[default]
    Spatial,
}

impl Default for IntegratorDesc {
    /// pbrt-v4's default: `volpath` to depth 5.
    fn default() -> Self {
        Self {
            name: "path".into(),
            max_depth: Some(5),
            rr_depth: None,
            light_selection: LightSelection::default(),
            parameters: BTreeMap::new(),
            span: Span::NONE,
        }
    }
}

/// Where samples come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SamplerDesc {
    /// `sobol`, `independent` or `stratified`.
    pub name: String,
    /// Samples in each pixel.
    pub spp: u32,
    /// Strata along x and y, for `stratified`.
    pub strata: [u32; 2],
    /// Seed of the randomness.
    pub seed: u64,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

impl Default for SamplerDesc {
    fn default() -> Self {
        Self { name: "sobol".into(), spp: 16, strata: [4, 4], seed: 0, span: Span::NONE }
    }
}
