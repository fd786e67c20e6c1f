//! Light that leaves a surface elsewhere than it enters, by a diffusion profile.

use scatter::DiffusionProfile;
use spectrum::Wavelengths;

use crate::{Scene, Shading, SurfaceInteraction, Surroundings};

impl Scene {
    /// By which light that enters at a surface leaves elsewhere, if it does.
    #[must_use]
    pub fn diffusion(&self, si: &SurfaceInteraction, wl: &mut Wavelengths) -> Option<DiffusionProfile> {
        self.materials.diffusion(&self.textures, si, &self.footprint(si), wl)
    }

    /// The BSDF of a surface where light emerges that has entered it elsewhere, seen from inside, and the factor on that
    /// light. `around` is what is outside.
    #[must_use]
    pub fn emergence(
        &self,
        si: &SurfaceInteraction,
        around: &Surroundings,
        wl: &mut Wavelengths,
    ) -> Option<(Shading, f32)> {
        let Shading { bsdf, frame } = self.shade(si, around, wl)?;
        let border = bsdf.as_soft_border()?;
        let (border, factor) = border.emerging();
        Some((Shading { bsdf: border.into(), frame }, factor))
    }
}
