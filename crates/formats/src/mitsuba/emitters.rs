//! Emitters: areas, environments, points, spots, projectors and parallel light.

use math::{AnimatedTransform, DMat4, DVec3, DVec4, Transform, Vec3};
use scene_desc::{
    AreaLightDesc, Illuminant, ImageEncoding, ImageId, LightDesc, LightKind, MediumId, SphericalMapping,
    SpotFalloff, Throw,
};

use super::build::Build;
use super::spectra::Spectral;
use super::tree::{Class, Node, Value};

/// Emitters that are known, supported or not.
const NAMES: [&str; 15] = [
    "area",
    "collimated",
    "constant",
    "directional",
    "directionalarea",
    "envmap",
    "point",
    "projector",
    "sky",
    "spot",
    "sun",
    "sunsky",
    "timed_sunsky",
    "volumelight",
    "vplaser",
];

/// What emits: a spectrum, or an image with a factor.
struct Emitted {
    radiance: Illuminant,
    image: Option<ImageId>,
}

impl<'t> Build<'t, '_, '_> {
    /// The emission of a property; `default` of white if there is none.
    fn emitted(&mut self, node: &'t Node, name: &'static str, default: f32) -> Emitted {
        let plain = |s: Spectral| Emitted { radiance: s.light(), image: None };
        let Some(p) = node.find(name) else { return plain(Spectral::Constant(default)) };
        match &p.value {
            Value::Float(x) => plain(Spectral::Constant(*x as f32)),
            Value::Integer(n) => plain(Spectral::Constant(*n as f32)),
            Value::Rgb(rgb) => plain(Spectral::Rgb(*rgb)),
            Value::Spectrum(s) => plain(s.clone()),
            Value::Object(_) | Value::Ref(_) => {
                let dark = Spectral::Constant(0.0);
                let Some(id) = self.object_of(p) else { return plain(dark) };
                let texture = self.tree.node(id);
                if let Some(s) = self.value_of(texture) {
                    return plain(s);
                }
                let image = self.image_of(id, &format!("\"{name}\" of {}", node.title()));
                let value = if image.is_some() { Spectral::Constant(1.0) } else { dark };
                Emitted { radiance: value.light(), image }
            }
            Value::Bool(_) | Value::Text(_) | Value::Vector(_) | Value::Transform(_) => {
                let message = format!("\"{name}\" of {} is a <{}>", node.title(), p.value.element());
                self.report.error(p.span, message).hint("expected <rgb>, <spectrum> or a texture");
                plain(Spectral::Constant(0.0))
            }
        }
    }

    /// The emission of a property that cannot be an image.
    fn plain_emission(&mut self, node: &'t Node, name: &'static str, default: f32) -> Illuminant {
        let Emitted { radiance, image } = self.emitted(node, name, default);
        if image.is_some() {
            let message = format!("\"{name}\" of {} cannot vary", node.title());
            self.report.error(node.span_of(name), message).hint("expected <rgb> or <spectrum>");
        }
        radiance
    }

    /// An `area` emitter within a shape.
    pub(super) fn area_light(&mut self, node: &'t Node) -> AreaLightDesc {
        let Emitted { radiance, image } = self.emitted(node, "radiance", 1.0);
        node.accept(&["sampling_weight"]);
        self.media_of(node);
        self.unused(node);
        AreaLightDesc { radiance, image, two_sided: false, power: None, span: node.span }
    }

    /// The medium around an emitter or a sensor.
    pub(super) fn media_of(&mut self, node: &'t Node) -> Option<MediumId> {
        let mut found = None;
        for p in &node.props {
            if let Some(id) = self.object_of(p)
                && self.tree.node(id).class == Class::Medium
            {
                p.used.set(true);
                found = self.medium(id);
            }
        }
        found
    }

    /// An emitter of the world.
    pub(super) fn emitter(&mut self, node: &'t Node) {
        node.accept(&["sampling_weight"]);
        let made = match node.kind.as_str() {
            "constant" => {
                let radiance = self.plain_emission(node, "radiance", 1.0);
                Some((
                    LightKind::InfiniteConstant { radiance, illuminance: None, portal: None },
                    Transform::IDENTITY,
                ))
            }
            "envmap" => self.envmap(node),
            "sky" | "sun" | "sunsky" => self.sun_and_sky(node),
            "point" => self.point(node),
            "spot" => self.spot(node),
            "projector" => self.projector(node),
            "directional" => Some(self.directional(node)),
            // It shines when a shape holds it.
            "area" => {
                node.accept_all();
                None
            }
            name if NAMES.contains(&name) => {
                self.unsupported(node, "it is left out: the scene is darker for it");
                None
            }
            _ => {
                self.unknown(node, &NAMES);
                None
            }
        };
        let medium = self.media_of(node);
        self.unused(node);
        if let Some((kind, place)) = made {
            let world_from_light = AnimatedTransform::fixed(place);
            self.scene.lights.push(LightDesc { kind, world_from_light, medium, span: node.span });
        }
    }

    fn envmap(&mut self, node: &'t Node) -> Option<(LightKind, Transform)> {
        let to_world = self.transform(node, "to_world");
        let scale = self.float(node, "scale", 1.0);
        node.accept(&["mis_compensation", "gamma", "cache"]);
        let image = self.image(node, ImageEncoding::Auto)?;
        // Mitsuba's columns run by φ from −z towards x, its rows from +y; ours by φ from x towards y, from +z.
        let rows = DMat4::from_cols(
            DVec4::new(0.0, 1.0, 0.0, 0.0),
            DVec4::new(0.0, 0.0, 1.0, 0.0),
            DVec4::new(-1.0, 0.0, 0.0, 0.0),
            DVec4::W,
        );
        let mapping = SphericalMapping::EquiRectangularPoles;
        let kind = LightKind::InfiniteImage { image, mapping, scale, illuminance: None, portal: None };
        Transform::from_matrix(rows).map(|t| (kind, to_world * t.inverse()))
    }

    fn point(&mut self, node: &'t Node) -> Option<(LightKind, Transform)> {
        let place = match self.vector(node, "position") {
            Some(p) => Transform::translate(p.as_dvec3()),
            None => self.transform(node, "to_world"),
        };
        let intensity = self.plain_emission(node, "intensity", 1.0);
        Some((LightKind::Point { intensity, from: Vec3::ZERO, power: None }, place))
    }

    fn spot(&mut self, node: &'t Node) -> Option<(LightKind, Transform)> {
        let place = self.transform(node, "to_world");
        let mut intensity = self.plain_emission(node, "intensity", 1.0);
        let cutoff = self.float(node, "cutoff_angle", 20.0);
        let beam = self.float(node, "beam_width", 0.75 * cutoff);
        if !(cutoff > 0.0 && cutoff < 90.0 && beam >= 0.0 && beam <= cutoff) {
            let message = format!("a cone of {cutoff} degrees with a beam of {beam}");
            return self.refuse(
                node.span,
                message,
                "expected 0 < \"cutoff_angle\" < 90, and no wider \"beam_width\"",
            );
        }
        if node.has("texture") {
            let slide = self.emitted(node, "texture", 1.0);
            if let Some(image) = slide.image {
                // Rows run with y.
                let turned = place * Transform::scale(DVec3::new(1.0, -1.0, 1.0))?;
                let throw = Throw::Cone { cone_angle: cutoff, cone_delta: cutoff - beam };
                let scale = self.grey(&intensity, node);
                return Some((
                    LightKind::Projection { image, fov: 2.0 * cutoff, scale, power: None, throw },
                    turned,
                ));
            }
            intensity.scale *= self.grey(&slide.radiance, node);
        }
        let kind = LightKind::Spot {
            intensity,
            from: Vec3::ZERO,
            to: Vec3::Z,
            cone_angle: cutoff,
            cone_delta: cutoff - beam,
            falloff: SpotFalloff::Linear,
            power: None,
        };
        Some((kind, place))
    }

    /// The size of a spectrum that only scales an image; of a colour its mean, which is told.
    fn grey(&mut self, light: &Illuminant, node: &Node) -> f32 {
        let value = match &light.spectrum {
            scene_desc::SpectrumDesc::Rgb { rgb: [r, g, b], .. } if r == g && g == b => *r,
            scene_desc::SpectrumDesc::Rgb { rgb: [r, g, b], .. } => {
                self.report
                    .warning(node.span_of("intensity"), "a colour that scales an image is not supported")
                    .hint("its mean is used");
                (r + g + b) / 3.0
            }
            _ => 1.0,
        };
        value * light.scale
    }

    fn projector(&mut self, node: &'t Node) -> Option<(LightKind, Transform)> {
        let place = self.transform(node, "to_world");
        let scale = self.float(node, "scale", 1.0) * std::f32::consts::PI;
        if !node.has("irradiance") {
            return self.refuse(node.span, "a projector without \"irradiance\"", "put a bitmap into it");
        }
        let image = self.emitted(node, "irradiance", 1.0).image;
        let fov = self.field_of_view(node);
        let image = image?;
        // Image x runs against Mitsuba's, which points left.
        let turned = place * Transform::scale(DVec3::new(-1.0, 1.0, 1.0))?;
        let throw = Throw::Irradiance { axis: fov.axis };
        Some((LightKind::Projection { image, fov: fov.degrees, scale, power: None, throw }, turned))
    }

    fn directional(&mut self, node: &'t Node) -> (LightKind, Transform) {
        let irradiance = self.plain_emission(node, "irradiance", 1.0);
        let (to, place) = match self.vector(node, "direction") {
            Some(d) if d != Vec3::ZERO => (d, Transform::IDENTITY),
            _ => (Vec3::Z, self.transform(node, "to_world")),
        };
        let kind = LightKind::Distant { radiance: irradiance, from: Vec3::ZERO, to, illuminance: None };
        (kind, place)
    }
}
