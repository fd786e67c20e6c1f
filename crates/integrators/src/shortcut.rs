//! What may stand for a part of a walk: light between surfaces of a class, had in another way than by walking on.

use scatter::Bsdf;
use scene::{Shading, SurfaceInteraction};

use crate::common::{Gathered, Shared};
use crate::parameters::{ParameterInfo, ParameterKind};
use crate::walker::Walker;

/// Parameter: see [`Shortcut::light_samples`].
pub(crate) const LIGHT_SAMPLES: ParameterInfo = ParameterInfo {
    name: "light_samples",
    kind: ParameterKind::Integer(1),
    doc: "light samples at a matt surface, dealt to the branches of the tree of lights",
};

/// Another way to have the light that surfaces of a class get from surfaces of the same class, emission left out. The
/// walk goes on for the rest: through other surfaces, and for the share that the shortcut leaves.
pub(crate) trait Shortcut: Send + Sync {
    /// Wavelengths and moment that all paths of a pass have; `None`: each its own.
    fn shared(&self) -> Option<Shared> {
        None
    }

    /// Is a surface of the class?
    fn takes(&self, bsdf: &Bsdf) -> bool;

    /// What a surface of the class, met by the walk, sends back of the light from others of the class, by its smooth
    /// lobes; `None` to let the walk find it.
    fn light(&self, walk: &mut Walker<'_>, si: &SurfaceInteraction, shading: &Shading) -> Option<Gathered>;

    /// The share of the light from `to`, of the class, to `from` that [`Shortcut::light`] left out.
    fn remainder(&self, from: (&SurfaceInteraction, &Shading), to: &SurfaceInteraction) -> f32;

    /// Light samples at a surface where the shortcut was taken.
    fn light_samples(&self) -> u32 {
        1
    }

    /// May there be anything for the walk to find behind a surface where the shortcut was taken?
    fn leaves_something(&self) -> bool;
}

/// No surface is of the class.
impl Shortcut for () {
    fn takes(&self, _: &Bsdf) -> bool {
        false
    }

    fn light(&self, _: &mut Walker<'_>, _: &SurfaceInteraction, _: &Shading) -> Option<Gathered> {
        None
    }

    fn remainder(&self, _: (&SurfaceInteraction, &Shading), _: &SurfaceInteraction) -> f32 {
        1.0
    }

    fn leaves_something(&self) -> bool {
        true
    }
}
