//! `LightSource` and `AreaLightSource`.

use math::Vec3;
use scene_desc::{
    AreaLightDesc, ColorSpaceName, ImageDesc, ImageEncoding, ImageId, LightDesc, LightKind, Span,
    SphericalMapping, SpotFalloff, Throw,
};

use super::build::Build;
use super::params::{Params, Type};
use super::state::{Entity, PlacedEntity};
use crate::equal_area::equal_area;
use crate::{source, suggest};

const NAMES: [&str; 6] = ["distant", "goniometric", "infinite", "point", "projection", "spot"];

impl Build<'_, '_> {
    pub(super) fn lights(&mut self, lights: &[PlacedEntity]) {
        for PlacedEntity { entity, medium } in lights {
            let Some(kind) = self.light_kind(entity) else { continue };
            entity.params.report_unused(&format!("light \"{}\"", entity.kind), self.report);
            let world_from_light = self.fixed(&entity.ctm, "a light", entity.span);
            let medium = self.medium(medium);
            self.scene.lights.push(LightDesc { kind, world_from_light, medium, span: entity.span });
        }
    }

    fn light_kind(&mut self, entity: &Entity) -> Option<LightKind> {
        let p = &entity.params;
        Some(match entity.kind.as_str() {
            "point" => LightKind::Point {
                intensity: self.illuminant(p, "I"),
                from: p.vec3("from", Type::Point3, Vec3::ZERO, self.report),
                power: self.positive(p, "power"),
            },
            "spot" => self.spot(entity),
            "distant" => {
                let (from, to) = self.ends(entity);
                let radiance = self.illuminant(p, "L");
                LightKind::Distant { radiance, from, to, illuminance: self.positive(p, "illuminance") }
            }
            "goniometric" => {
                if let Some((name, span)) = p.string_opt("filename", self.report).filter(|(f, _)| is_ies(f)) {
                    return self.ies(p, &name, span);
                }
                if p.span_of("filename").is_none() {
                    self.report
                        .warning(entity.span, "light \"goniometric\" has no \"filename\"")
                        .hint("it shines alike in all directions");
                }
                let mut image = self.image_param(p, "filename", ImageEncoding::Auto);
                if self.is_old {
                    image = image.and_then(|id| self.equal_area_of(id, entity.span));
                }
                LightKind::Goniometric {
                    intensity: self.illuminant(p, "I"),
                    image,
                    power: self.positive(p, "power"),
                }
            }
            "projection" => return self.projection(entity),
            "infinite" => return self.infinite(entity),
            name => {
                let message = format!("unknown light \"{name}\"");
                return self.refuse(entity.span, message, suggest::hint(name, &NAMES));
            }
        })
    }

    /// pbrt-v3's map of longitude and latitude as pbrt-v4's of equal areas: both have "up" along the light's y axis.
    fn equal_area_of(&mut self, id: ImageId, span: Span) -> Option<ImageId> {
        let path = self.scene.images[id.index()].path.clone();
        let map = image::load(&path).and_then(|source| {
            let map = equal_area(&source, SphericalMapping::EquiRectangular)?;
            image::encode(&map, image::Format::Pfm, &image::SaveOptions::default())
        });
        let bytes = match map {
            Ok(bytes) => bytes,
            Err(e) => {
                return self.refuse(span, format!("image {}: {e}", path.display()), "it is the light's map");
            }
        };
        let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        self.scene.images.push(ImageDesc {
            path: format!("{name}-equal-area.pfm").into(),
            encoding: ImageEncoding::Linear,
            space: ColorSpaceName::Srgb,
            channel: None,
            embedded: Some(bytes.into()),
            span,
        });
        Some(ImageId(u32::try_from(self.scene.images.len() - 1).unwrap_or(u32::MAX)))
    }

    /// An extension of ours: a photometric file where pbrt takes an image.
    fn ies(&mut self, p: &Params, name: &str, span: Span) -> Option<LightKind> {
        let path = self.resolve(name);
        match source::hash(&path) {
            Ok(hash) => self.hashes.push(hash),
            Err(e) => {
                let message = format!("lamp {} cannot be read: {e}", path.display());
                return self.refuse(span, message, e.hint());
            }
        }
        Some(LightKind::Ies { path, intensity: self.illuminant(p, "I"), power: self.positive(p, "power") })
    }

    /// A value that counts only above 0, as pbrt has it.
    fn positive(&mut self, p: &Params, name: &'static str) -> Option<f32> {
        p.float_opt(name, self.report).filter(|x| *x > 0.0)
    }

    fn ends(&mut self, entity: &Entity) -> (Vec3, Vec3) {
        let p = &entity.params;
        let from = p.vec3("from", Type::Point3, Vec3::ZERO, self.report);
        let to = p.vec3("to", Type::Point3, Vec3::Z, self.report);
        if from == to {
            let at = p.span_of("to").or(p.span_of("from")).unwrap_or(entity.span);
            let message = format!("light \"{}\" shines from a point to itself", entity.kind);
            self.report.error(at, message).hint("\"from\" and \"to\" must differ");
        }
        (from, to)
    }

    fn spot(&mut self, entity: &Entity) -> LightKind {
        let p = &entity.params;
        let (from, to) = self.ends(entity);
        let cone_angle = p.float("coneangle", 30.0, self.report);
        let cone_delta = p.float("conedeltaangle", 5.0, self.report);
        if !(cone_angle > 0.0 && cone_angle <= 180.0) {
            let at = p.span_of("coneangle").unwrap_or(entity.span);
            self.report.error(at, format!("\"coneangle\" is {cone_angle}")).hint("expected 0 to 180 degrees");
        }
        if !(cone_delta >= 0.0 && cone_delta <= cone_angle) {
            let at = p.span_of("conedeltaangle").or(p.span_of("coneangle")).unwrap_or(entity.span);
            self.report
                .error(at, format!("\"conedeltaangle\" is {cone_delta}"))
                .hint(format!("expected 0 to {cone_angle}, the cone's own angle"));
        }
        let intensity = self.illuminant(p, "I");
        LightKind::Spot {
            intensity,
            from,
            to,
            cone_angle,
            cone_delta,
            falloff: SpotFalloff::Smooth,
            power: self.positive(p, "power"),
        }
    }

    fn projection(&mut self, entity: &Entity) -> Option<LightKind> {
        let p = &entity.params;
        let scale = p.float("scale", 1.0, self.report);
        let power = self.positive(p, "power");
        let fov = p.float("fov", 90.0, self.report);
        if !(fov > 0.0 && fov < 180.0) {
            let at = p.span_of("fov").unwrap_or(entity.span);
            self.report.error(at, format!("a field of view of {fov} degrees")).hint("expected 0 to 180");
        }
        if p.span_of("filename").is_none() {
            let hint = "add \"string filename\" \"…\"";
            return self.refuse(entity.span, "light \"projection\" has no \"filename\"", hint);
        }
        let image = self.image_param(p, "filename", ImageEncoding::Auto)?;
        Some(LightKind::Projection { image, fov, scale, power, throw: Throw::Intensity })
    }

    fn infinite(&mut self, entity: &Entity) -> Option<LightKind> {
        let p = &entity.params;
        if let Some(span) = p.span_of("mapname") {
            super::parser::old_syntax(self.report, span, "\"mapname\"", "\"filename\"");
            return None;
        }
        let illuminance = self.positive(p, "illuminance");
        let corners = p.vec3s("portal", Type::Point3);
        let portal = if corners.is_empty() {
            None
        } else if let Ok(four) = <[Vec3; 4]>::try_from(corners.as_slice()) {
            Some(four)
        } else {
            let at = p.span_of("portal").unwrap_or(entity.span);
            return self.refuse(at, format!("\"portal\" has {} corners", corners.len()), "it takes four");
        };
        let has_color = p.span_of("L").is_some();
        if p.string_opt("filename", self.report).is_none_or(|f| f.0.is_empty()) {
            let radiance = self.illuminant(p, "L");
            return Some(LightKind::InfiniteConstant { radiance, illuminance, portal });
        }
        if has_color {
            let at = p.span_of("L").unwrap_or(entity.span);
            let message = "light \"infinite\" has both \"L\" and \"filename\"";
            return self.refuse(at, message, "give one of them; \"scale\" changes the image's size");
        }
        let scale = p.float("scale", 1.0, self.report);
        let image = self.image_param(p, "filename", ImageEncoding::Auto)?;
        Some(LightKind::InfiniteImage {
            image,
            mapping: if self.is_old {
                SphericalMapping::EquiRectangular
            } else {
                SphericalMapping::EqualArea
            },
            scale,
            illuminance,
            portal,
        })
    }

    /// Builds all area lights; `None` where one could not be made.
    pub(super) fn area_lights(&mut self, lights: &[Entity]) -> Vec<Option<AreaLightDesc>> {
        lights.iter().map(|entity| self.area_light(entity)).collect()
    }

    fn area_light(&mut self, entity: &Entity) -> Option<AreaLightDesc> {
        let p = &entity.params;
        match entity.kind.as_str() {
            "diffuse" => {}
            "" => return None,
            "area" => {
                super::parser::old_syntax(self.report, entity.span, "area light \"area\"", "\"diffuse\"");
                return None;
            }
            name => {
                let message = format!("unknown area light \"{name}\"");
                return self.refuse(entity.span, message, suggest::hint(name, &["diffuse"]));
            }
        }
        let file = p.string_opt("filename", self.report).filter(|f| !f.0.is_empty());
        if let (Some(at), Some(_)) = (p.span_of("L"), &file) {
            let message = "area light \"diffuse\" has both \"L\" and \"filename\"";
            return self.refuse(at, message, "give one of them; \"scale\" changes the image's size");
        }
        let image = match file {
            Some((name, span)) => Some(self.image(&name, span, ImageEncoding::Auto)?),
            None => None,
        };
        let radiance = self.illuminant(p, "L");
        let two_sided = p.boolean("twosided", false, self.report);
        let power = self.positive(p, "power");
        p.report_unused("area light \"diffuse\"", self.report);
        Some(AreaLightDesc { radiance, image, two_sided, power, span: entity.span })
    }
}

/// Is a goniometric light's file a photometric one?
pub(super) fn is_ies(name: &str) -> bool {
    std::path::Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("ies"))
}
