//! `LightSource`.

use scene_desc::{LightDesc, LightKind, SphericalMapping, SpotFalloff, Throw};

use super::params::Params;
use super::{WriteError, Writer};
use crate::source;

impl Writer<'_, '_, '_> {
    pub(super) fn lights(&mut self) -> Result<(), WriteError> {
        for light in &self.scene.lights {
            let mut p = Params::default();
            let kind = self.light(&mut p, light)?;
            self.line(0, "AttributeBegin");
            self.transform(1, &light.world_from_light, light.span);
            if let Some(id) = light.medium {
                self.line(1, &format!("MediumInterface \"\" \"medium-{}\"", id.0));
            }
            self.line(1, &format!("LightSource \"{kind}\"{}", p.0));
            self.line(0, "AttributeEnd");
        }
        Ok(())
    }

    #[allow(clippy::too_many_lines, reason = "one arm a kind")]
    fn light(&mut self, p: &mut Params, light: &LightDesc) -> Result<&'static str, WriteError> {
        let span = light.span;
        let optional = |p: &mut Params, name: &str, x: Option<f32>| {
            if let Some(x) = x {
                p.float(name, x);
            }
        };
        Ok(match &light.kind {
            LightKind::Point { intensity, from, power } => {
                self.illuminant(p, "I", intensity, span);
                p.vec3s("point3", "from", &[*from]);
                optional(p, "power", *power);
                "point"
            }
            LightKind::Spot { intensity, from, to, cone_angle, cone_delta, falloff, power } => {
                self.illuminant(p, "I", intensity, span);
                p.vec3s("point3", "from", &[*from]);
                p.vec3s("point3", "to", &[*to]);
                p.float("coneangle", *cone_angle);
                p.float("conedeltaangle", *cone_delta);
                if *falloff == SpotFalloff::Linear {
                    self.otherwise(
                        span,
                        "spot that falls linearly",
                        "pbrt's falls smoothly over the same angles",
                    );
                }
                optional(p, "power", *power);
                "spot"
            }
            LightKind::Distant { radiance, from, to, illuminance } => {
                self.illuminant(p, "L", radiance, span);
                p.vec3s("point3", "from", &[*from]);
                p.vec3s("point3", "to", &[*to]);
                optional(p, "illuminance", *illuminance);
                "distant"
            }
            LightKind::InfiniteConstant { radiance, illuminance, portal } => {
                self.illuminant(p, "L", radiance, span);
                optional(p, "illuminance", *illuminance);
                if let Some(corners) = portal {
                    p.vec3s("point3", "portal", corners);
                }
                "infinite"
            }
            LightKind::InfiniteImage { image, mapping, scale, illuminance, portal } => {
                let name = match mapping {
                    SphericalMapping::EqualArea => self.image(*image)?,
                    SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
                        self.equal_area(*image, *mapping, span)?
                    }
                };
                p.string("filename", &name);
                p.float_unless("scale", *scale, 1.0);
                optional(p, "illuminance", *illuminance);
                if let Some(corners) = portal {
                    p.vec3s("point3", "portal", corners);
                }
                "infinite"
            }
            LightKind::Goniometric { intensity, image, power } => {
                self.illuminant(p, "I", intensity, span);
                if let Some(id) = image {
                    let name = self.image(*id)?;
                    p.string("filename", &name);
                }
                optional(p, "power", *power);
                "goniometric"
            }
            LightKind::Ies { path, intensity, power } => {
                self.illuminant(p, "I", intensity, span);
                let bytes =
                    std::fs::read(path).map_err(|source| WriteError::Io { path: path.clone(), source })?;
                let own = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                // Lamps of different folders may have one name.
                let name = self.file(&format!("{:08x}-{own}", source::hash_of(&bytes) as u32), &bytes)?;
                p.string("filename", &name);
                optional(p, "power", *power);
                self.otherwise(
                    span,
                    "lamp with a photometric file",
                    "Steradian reads it back; pbrt-v4 has no such light",
                );
                "goniometric"
            }
            LightKind::Projection { image, fov, throw, scale, power } => {
                if *throw != Throw::Intensity {
                    let instead = "pbrt's projector is written, whose slide says the intensity";
                    self.otherwise(span, "projector of this kind", instead);
                }
                let name = self.image(*image)?;
                p.string("filename", &name);
                p.float("fov", *fov);
                p.float_unless("scale", *scale, 1.0);
                optional(p, "power", *power);
                "projection"
            }
        })
    }
}
