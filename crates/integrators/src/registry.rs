//! The list of integrators: what each is for, what it misses, what can be set.

use scene::Scene;
use scene_desc::{ParameterValue, SamplerDesc};

use crate::parameters::{ParameterError, ParameterInfo, Parameters};
use crate::{
    Integrator, ao, bdpt, direct, guided, irradiance_cache, light, manifold, many_light, mlt, path, photon,
    recursive, sppm, vcm,
};

/// What a person and the command line need to know of an integrator.
pub struct IntegratorInfo {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is for, in a sentence.
    pub purpose: &'static str,
    /// What it cannot find, in a sentence.
    pub misses: &'static str,
    /// Is its expected value the right image?
    pub unbiased: bool,
    /// What of a scene it cannot render, in a sentence that names an integrator that can; `None`: it renders all of it.
    pub refuses: fn(&Scene) -> Option<&'static str>,
    /// What can be set.
    pub parameters: fn() -> Vec<ParameterInfo>,
    /// Makes one from checked parameters.
    pub make: fn(&Parameters, &Making<'_>) -> Box<dyn Integrator>,
}

/// What an integrator is made for.
#[derive(Clone, Copy)]
pub struct Making<'a> {
    /// The scene that it will render.
    pub scene: &'a Scene,
    /// Where its samples come from.
    pub sampler: &'a SamplerDesc,
    /// Seed of all randomness.
    pub seed: u64,
}

/// For integrators that render every scene.
pub(crate) fn refuses_nothing(_: &Scene) -> Option<&'static str> {
    None
}

/// For integrators that know no diffusion profiles.
pub(crate) fn refuses_diffusion(scene: &Scene) -> Option<&'static str> {
    scene.materials.has_diffusion().then_some(
        "it does not render subsurface materials of method \"separable\"; path and guided do, and of method \"walk\" all that \
         render media",
    )
}

/// For integrators that keep what walks from the lights leave on surfaces.
pub(crate) fn refuses_for_light_walks(scene: &Scene) -> Option<&'static str> {
    if let Some(reason) = refuses_diffusion(scene) {
        return Some(reason);
    }
    if scene.has_light_from_beyond_a_medium() {
        return Some(
            "the medium around the camera has no end, and its walks from a light at infinity would start inside of it; put a \
             closed shape around the medium, or use path, which finds that none of this light gets through",
        );
    }
    scene.has_turning_strands().then_some(
        "it does not render flat and cylindrical curves, which turn to every ray and so are other surfaces to light than \
         to the eye; path does, and ribbons are rendered by all",
    )
}

/// For integrators that join walks from the lights to the camera.
pub(crate) fn refuses_for_light_paths(scene: &Scene) -> Option<&'static str> {
    let stack = (!scene.camera.has_importance()).then_some(
        "it joins light paths to the camera, which cannot be done through a stack of lenses; path sees through it",
    );
    stack.or_else(|| refuses_for_light_walks(scene))
}

/// For integrators whose walks do not start in media that glow.
pub(crate) fn refuses_glow(scene: &Scene) -> Option<&'static str> {
    scene.media.any_emits().then_some(
        "its light paths do not start in media that glow; path, bdpt, vcm and mlt find their light",
    )
}

/// For integrators that know surfaces alone.
pub(crate) fn refuses_media(scene: &Scene) -> Option<&'static str> {
    let media = scene.has_media().then_some(
        "it does not render participating media, nor what lies under subsurface materials; path, bdpt and sppm do",
    );
    media.or_else(|| refuses_diffusion(scene))
}

/// All integrators, in the order in which they are taught.
#[must_use]
pub fn list() -> &'static [IntegratorInfo] {
    &[
        ao::INFO,
        direct::INFO,
        recursive::INFO,
        path::INFO,
        light::INFO,
        bdpt::INFO,
        many_light::INFO,
        photon::INFO,
        sppm::INFO,
        vcm::INFO,
        irradiance_cache::INFO,
        mlt::INFO,
        guided::INFO,
    ]
}

/// An integrator by name.
///
/// # Errors
/// No such integrator.
pub fn find(name: &str) -> Result<&'static IntegratorInfo, ParameterError> {
    list().iter().find(|i| i.name == name).ok_or_else(|| ParameterError::NoIntegrator {
        name: name.to_owned(),
        known: list().iter().map(|i| i.name).collect::<Vec<_>>().join(", "),
    })
}

/// Does an integrator keep what it learned for later passes, in rounds ([`Integrator::round`])? Then whoever spreads a render over
/// machines sends it to them.
#[must_use]
pub fn learns(name: &str) -> bool {
    [guided::INFO.name, irradiance_cache::INFO.name].contains(&name)
}

/// Makes an integrator; `given` are parameters as file and command line say them, later ones win. The second value
/// names every setting ([`Parameters::canonical`]).
///
/// # Errors
/// No such integrator, no such parameter, a value not of its kind, or a scene that the integrator cannot render.
pub fn create<'a>(
    name: &str,
    given: impl IntoIterator<Item = (&'a str, &'a ParameterValue)>,
    making: &Making<'_>,
) -> Result<(Box<dyn Integrator>, String), ParameterError> {
    let info = find(name)?;
    let infos = (info.parameters)();
    let parameters = Parameters::new(name, &infos, given)?;
    let has_manifold = infos.iter().any(|i| i.name == manifold::PARAMETER.name);
    let of_manifold = || has_manifold.then(|| manifold::refuses(making.scene, &parameters)).flatten();
    if let Some(reason) = (info.refuses)(making.scene).or_else(of_manifold) {
        return Err(ParameterError::Refused { integrator: name.to_owned(), reason });
    }
    Ok(((info.make)(&parameters, making), parameters.canonical()))
}
