//! From descriptions to lights.
//!
//! The size of a light is pbrt-v4's: `scale` over the spectrum's luminance integral, times `power` (or
//! `illuminance`) over what the light would emit. A mesh's `power` is each triangle's, as in pbrt-v4, where every
//! triangle is a light.
//!
//! pbrt-v4 measures the illuminance of an image over the upper half of its square with the pixels' size of half a
//! sphere; so do we, to get its pictures.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use math::{Bounds, Dir, Frame, Point, Transform, Vec3, trig};
use sampling::warp;
use scene_desc::{AreaLightDesc, Illuminant, ImageId, LightDesc, LightKind, Sink, Span, SphericalMapping};
use spectrum::ColorPipeline;

use super::area::AreaLight;
use super::delta::{DistantLight, PointLight, SpotLight};
use super::emission::{Emission, ImageEmission, LightImage, Lookup};
use super::goniometric::{DirectionFactor, GoniometricLight, ScalarImage};
use super::infinite::{InfiniteConstant, InfiniteImage};
use super::moving::{Motion, MovingLight};
use super::portal::{PortalLight, Sky};
use super::projection::projection;
use super::source::{EmitterSource, emitters};
use super::web::Web;
use super::{Light, Lights};
use crate::LightId;
use crate::linear_map::AffineMap;

/// Collects lights; [`LightsBuilder::finish`] makes them usable.
pub struct LightsBuilder<'a> {
    colors: ColorPipeline,
    images: &'a dyn Fn(ImageId) -> LightImage,
    lights: Lights,
}

impl<'a> LightsBuilder<'a> {
    /// No lights yet. `images` gives an image of the scene, decoded.
    #[must_use]
    pub fn new(colors: ColorPipeline, images: &'a dyn Fn(ImageId) -> LightImage) -> Self {
        Self { colors, images, lights: Lights::default() }
    }

    /// How many lights there are by now.
    pub(crate) fn len(&self) -> usize {
        self.lights.list.len()
    }

    /// Adds a light that is not a surface. What is wrong with it goes to `sink`; a light that emits nothing still has
    /// an id.
    pub fn add_light(&mut self, desc: &LightDesc, sink: &mut Sink) -> LightId {
        if desc.world_from_light.is_animated() {
            sink.warning(desc.span, "lights do not move").hint("its place at the first key is used");
        }
        let light = Placed::new(self, desc, sink).and_then(|p| p.light(desc, sink));
        if light.is_none() && !sink.has_errors() {
            sink.warning(desc.span, "this light emits nothing");
        }
        self.push(light)
    }

    /// Adds the lights of an emitting shape: one for each triangle or patch, in their order, from the returned id on.
    /// `None` for a shape that emits nothing, which is no light at all.
    pub fn add_emitter(&mut self, source: &EmitterSource<'_>, sink: &mut Sink) -> Option<LightId> {
        let emission = self.add_emission(source.desc, sink)?;
        Some(self.add_emitter_of(source, emission, sink))
    }

    /// What shapes emit, for [`LightsBuilder::add_emitter_of`]; `None` if that is nothing.
    pub(crate) fn add_emission(&mut self, desc: &AreaLightDesc, sink: &mut Sink) -> Option<AreaEmission> {
        let emission = self.area_emission(desc, sink);
        if emission.mean() <= 0.0 {
            return None;
        }
        // What `power` is measured with.
        let unit_luminance = desc.image.map_or(1.0, |id| {
            let image = (self.images)(id);
            image.mean(|rgb, _| image.luminance(rgb))
        });
        self.lights.emissions.push(emission);
        Some(AreaEmission { index: self.lights.emissions.len() as u32 - 1, unit_luminance })
    }

    /// [`LightsBuilder::add_emitter`] with an emission that others may share. Always as many lights as the form has parts.
    pub(crate) fn add_emitter_of(
        &mut self,
        source: &EmitterSource<'_>,
        emission: AreaEmission,
        sink: &mut Sink,
    ) -> LightId {
        let desc = source.desc;
        let motion = source.motion.filter(|m| m.is_animated()).map(Motion::new);
        let motion = match motion {
            Some(None) => {
                sink.error(desc.span, "an emitting shape moves by transforms that are not affine");
                None
            }
            Some(motion) => motion.map(Arc::new),
            None => None,
        };
        let first = LightId(self.lights.list.len() as u32);
        let mut any = false;
        for emitter in emitters(source) {
            let light = emitter.map(|emitter| {
                let (two_sided, visible) = (desc.two_sided, source.visible);
                let area = AreaLight { emitter, emission: emission.index, factor: 1.0, two_sided, visible };
                emission.with_power(area, motion.as_ref(), desc.power)
            });
            any |= light.is_some();
            self.push(light);
        }
        if !any {
            sink.warning(desc.span, "an emitting shape has no area").hint("it emits nothing");
        }
        first
    }

    /// All lights, for a scene of this extent.
    #[must_use]
    pub fn finish(mut self, scene_bounds: Bounds) -> Lights {
        self.lights.finish(scene_bounds);
        self.lights
    }

    fn push(&mut self, light: Option<Light>) -> LightId {
        self.lights.list.push(light.unwrap_or(Light::Dark));
        LightId(self.lights.list.len() as u32 - 1)
    }

    fn area_emission(&self, desc: &AreaLightDesc, sink: &mut Sink) -> Emission {
        match desc.image {
            Some(id) => {
                let image = (self.images)(id);
                check_pixels(&image, desc.span, sink);
                Emission::of_image(ImageEmission::new(
                    image,
                    desc.radiance.scale,
                    Lookup::Bilinear,
                    self.colors,
                ))
            }
            None => Emission::new(&desc.radiance, 1.0, self.colors, desc.span, sink),
        }
    }
}

/// What a shape emits, kept among the emissions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AreaEmission {
    index: u32,
    /// Luminance of what it is with a scale of one.
    unit_luminance: f32,
}

impl AreaEmission {
    /// The light of a part of a shape, at rest or in motion, of a stated power if there is one.
    fn with_power(self, mut area: AreaLight, motion: Option<&Arc<Motion>>, power: Option<f32>) -> Light {
        let sides = area.sides();
        let factor = |size: f32| power.map_or(1.0, |p| p / (self.unit_luminance * sides * size * PI));
        match motion {
            None => {
                area.factor = factor(area.emitter.area());
                Light::Area(area)
            }
            Some(motion) => {
                let mut moving = MovingLight { area, motion: Arc::clone(motion) };
                moving.area.factor = factor(moving.area());
                Light::Moving(Box::new(moving))
            }
        }
    }
}

/// What all lights that are no surfaces have.
struct Placed<'b> {
    colors: ColorPipeline,
    images: &'b dyn Fn(ImageId) -> LightImage,
    world_from_light: Transform,
    map: AffineMap,
    span: Span,
}

impl<'b> Placed<'b> {
    fn new(builder: &LightsBuilder<'b>, desc: &LightDesc, sink: &mut Sink) -> Option<Self> {
        let world_from_light = desc.world_from_light.start();
        let map = AffineMap::of(&world_from_light);
        if map.is_none() {
            sink.error(desc.span, "the light's transform is not affine").hint("it needs an inverse");
        }
        let (colors, images) = (builder.colors, builder.images);
        map.map(|map| Self { colors, images, world_from_light, map, span: desc.span })
    }

    /// `None` if it emits nothing.
    fn light(&self, desc: &LightDesc, sink: &mut Sink) -> Option<Light> {
        match &desc.kind {
            LightKind::Point { intensity, from, power } => {
                let intensity = self.emission(intensity, power.map(|p| p / (2.0 * TAU)), sink)?;
                Some(Light::Point(PointLight { p: self.world_from_light.point(Point(*from)), intensity }))
            }
            LightKind::Spot { .. } => self.spot(&desc.kind, sink),
            LightKind::Distant { radiance, from, to, illuminance } => {
                let irradiance = self.emission(radiance, *illuminance, sink)?;
                let to_light = self.dir(*from - *to, sink)?;
                Some(Light::Distant(DistantLight { to_light, irradiance }))
            }
            LightKind::InfiniteConstant { radiance, illuminance, portal } => {
                let radiance = self.emission(radiance, illuminance.map(|e| e / PI), sink)?;
                if let Some(corners) = portal {
                    return self.portal(corners, Sky::Even(radiance), sink);
                }
                Some(Light::InfiniteConstant(InfiniteConstant { radiance }))
            }
            LightKind::InfiniteImage { image, mapping, scale, illuminance, portal } => {
                let image = self.image(*image, sink);
                let factor = illuminance.map_or(1.0, |e| e / upper_illuminance(&image));
                let lookup = match mapping {
                    SphericalMapping::EqualArea => Lookup::Nearest,
                    SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
                        Lookup::BilinearRound
                    }
                };
                let emission = ImageEmission::new(image, scale * factor, lookup, self.colors);
                let sky = Box::new(InfiniteImage::new(self.map.linear, emission, *mapping)?);
                match portal {
                    Some(corners) => self.portal(corners, Sky::Image(sky), sink),
                    None => Some(Light::InfiniteImage(sky)),
                }
            }
            LightKind::Goniometric { intensity, image, power } => {
                self.goniometric(intensity, *power, self.pattern(*image, sink)?, sink)
            }
            LightKind::Ies { path, intensity, power } => {
                let web = super::ies::load(path).map(|p| Web::new(&p));
                let web = web.map_err(|e| {
                    sink.error(self.span, e).hint("a lamp's file of LM-63, photometry of type C")
                });
                self.goniometric(intensity, *power, DirectionFactor::Web(web.ok()??), sink)
            }
            LightKind::Projection { image, fov, scale, power, throw } => {
                let image = self.image(*image, sink);
                projection(self.map, image, (*fov, *throw), (*scale, *power), self.colors)
            }
        }
    }

    fn portal(&self, corners: &[Vec3; 4], sky: Sky, sink: &mut Sink) -> Option<Light> {
        let light = PortalLight::new(corners, sky);
        let light = light
            .map_err(|e| sink.error(self.span, e).hint("four corners of a rectangle, one after the other"));
        light.ok()?.map(|l| Light::Portal(Box::new(l)))
    }

    fn spot(&self, kind: &LightKind, sink: &mut Sink) -> Option<Light> {
        let LightKind::Spot { intensity, from, to, cone_angle, cone_delta, falloff, power } = kind else {
            return None;
        };
        let cos_start = trig::cos((cone_angle - cone_delta).max(0.0).to_radians());
        let cos_end = trig::cos(cone_angle.to_radians());
        let frame = Frame::from_normal(self.dir(*to - *from, sink)?);
        let p = self.world_from_light.point(Point(*from));
        let intensity = self.emission(intensity, None, sink)?;
        let mut spot = SpotLight { p, frame, cos_start, cos_end, falloff: *falloff, intensity };
        let solid_angle = spot.solid_angle();
        if let (LightKind::Spot { intensity, .. }, Some(power)) = (kind, power) {
            spot.intensity = self.emission(intensity, Some(power / solid_angle), sink)?;
        }
        (solid_angle > 0.0).then_some(Light::Spot(spot))
    }

    fn pattern(&self, image: Option<ImageId>, sink: &mut Sink) -> Option<DirectionFactor> {
        let Some(id) = image else { return ScalarImage::new(1, vec![1.0]).map(DirectionFactor::Image) };
        let image = self.image(id, sink);
        let mean_rgb = |p: &[f32; 3]| ((p[0] + p[1] + p[2]) / 3.0).max(0.0);
        let values = image.pixels().iter().map(mean_rgb).collect();
        ScalarImage::new(image.size()[0], values).map(DirectionFactor::Image)
    }

    fn goniometric(
        &self,
        intensity: &Illuminant,
        power: Option<f32>,
        factor: DirectionFactor,
        sink: &mut Sink,
    ) -> Option<Light> {
        let intensity = self.emission(intensity, power.map(|p| p / (2.0 * TAU * factor.mean())), sink)?;
        // The factor's z axis is the light's y axis: y and z change places.
        let swap = math::DMat4::from_cols(math::DVec4::X, math::DVec4::Z, math::DVec4::Y, math::DVec4::W);
        let world_from_light = AffineMap::of(&(self.world_from_light * Transform::from_matrix(swap)?))?;
        Some(Light::Goniometric(Box::new(GoniometricLight { world_from_light, intensity, factor })))
    }

    /// `None` if it is black.
    fn emission(&self, illuminant: &Illuminant, factor: Option<f32>, sink: &mut Sink) -> Option<Emission> {
        let e = Emission::new(illuminant, factor.unwrap_or(1.0), self.colors, self.span, sink);
        (e.mean() > 0.0).then_some(e)
    }

    fn image(&self, id: ImageId, sink: &mut Sink) -> LightImage {
        let image = (self.images)(id);
        check_pixels(&image, self.span, sink);
        image
    }

    fn dir(&self, v: Vec3, sink: &mut Sink) -> Option<Dir> {
        let d = self.world_from_light.vector(v).try_normalize();
        if d.is_none() {
            sink.error(self.span, "the light has no direction").hint("`from` and `to` are the same point");
        }
        d.map(Dir)
    }
}

fn check_pixels(image: &LightImage, span: Span, sink: &mut Sink) {
    if image.has_bad_pixels() {
        sink.error(span, "the light's image has pixels that are infinite or not a number")
            .hint("such a light has no finite power; mend the image");
    }
}

/// pbrt-v4's illuminance of an image from above (see the head).
fn upper_illuminance(image: &LightImage) -> f32 {
    TAU * image.mean(|rgb, uv| {
        let z = warp::equal_area_sphere(uv).0.z;
        if z > 0.0 { image.luminance(rgb) * z } else { 0.0 }
    })
}
