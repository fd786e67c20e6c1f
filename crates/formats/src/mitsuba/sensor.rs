//! Sensors with their films, filters and samplers.
//!
//! Mitsuba's camera space is right-handed: it looks along +z with x to the left; ours has x to the right.

use math::{DVec3, Transform, trig};
use scene_desc::{
    ApertureDesc, CameraDesc, CameraKind, FilmDesc, FilterDesc, FovAxis, SamplerDesc, SphericalMapping,
};

use super::build::Build;
use super::text;
use super::tree::{Class, Node, NodeId, Prop, Value};

const SENSORS: [&str; 11] = [
    "batch",
    "distant",
    "fluence_meter",
    "irradiancemeter",
    "orthographic",
    "perspective",
    "radiancemeter",
    "spherical",
    "telecentric",
    "thinlens",
    "perspective_rdist",
];
const SAMPLERS: [&str; 10] = [
    "halton",
    "hammersley",
    "independent",
    "ldsampler",
    "multijitter",
    "orthogonal",
    "sobol",
    "stratified",
    "pmj02bn",
    "padded",
];
const FILTERS: [&str; 6] = ["box", "catmullrom", "gaussian", "lanczos", "mitchell", "tent"];

/// Samples of a file that does not say.
const DEFAULT_SPP: u32 = 4;

/// A field of view and what it spans.
pub(super) struct FieldOfView {
    pub(super) degrees: f32,
    pub(super) axis: FovAxis,
}

/// Half of the x axis, at distance one, that a field of view means for an image of this width over height.
fn half_width(fov: &FieldOfView, aspect: f64) -> f64 {
    let tan = trig::f64::tan(f64::from(fov.degrees).to_radians() * 0.5);
    match fov.axis {
        FovAxis::X => tan,
        FovAxis::Y => tan * aspect,
        FovAxis::Diagonal => tan * aspect / (1.0 + aspect * aspect).sqrt(),
        FovAxis::Smaller => tan * aspect.max(1.0),
        FovAxis::Larger => tan * aspect.min(1.0),
    }
}

impl<'t> Build<'t, '_, '_> {
    /// The first sensor; others are told.
    pub(super) fn sensor(&mut self, children: &[(&'t Prop, &'t Node, NodeId)]) {
        let mut sensors = children.iter().map(|c| c.1).filter(|n| n.class == Class::Sensor);
        self.scene.sampler = SamplerDesc { spp: DEFAULT_SPP, ..SamplerDesc::default() };
        let Some(sensor) = sensors.next() else {
            let span = self.tree.nodes.first().map(|n| n.span).unwrap_or_default();
            self.report.error(span, "the scene has no sensor").hint("add <sensor type=\"perspective\"> …");
            return;
        };
        for other in sensors {
            other.accept_all();
            self.report.warning(other.span, "a second sensor").hint("the first one is used");
        }
        let medium = self.media_of(sensor);
        let mut film = None;
        for (_, child, _) in self.children(sensor) {
            match child.class {
                Class::Film => film = Some(child),
                Class::Sampler => self.sampler(child),
                Class::Medium => {}
                _ => self.misplaced(child, sensor),
            }
        }
        match film {
            Some(film) => self.film(film),
            None => {
                self.scene.film = FilmDesc { resolution: [768, 576], ..FilmDesc::default() };
                self.scene.filter = FilterDesc::Gaussian { radius: [2.0; 2], sigma: 0.5 };
            }
        }
        self.camera(sensor, medium);
        self.unused(sensor);
    }

    fn camera(&mut self, node: &'t Node, medium: Option<scene_desc::MediumId>) {
        let [w, h] = self.scene.film.resolution;
        let aspect = f64::from(w) / f64::from(h);
        let to_world = self.animated(node, "to_world");
        node.accept(&["near_clip", "far_clip", "srf"]);
        let open = self.float(node, "shutter_open", 0.0);
        let close = self.float(node, "shutter_close", open);
        let shorter = aspect.min(1.0);
        let (kind, half) = match node.kind.as_str() {
            "perspective" | "thinlens" => {
                let fov = self.field_of_view(node);
                let half = half_width(&fov, aspect);
                // The field of view of the shorter side, of a window that spans −1 to 1 along it.
                let fov =
                    2.0 * trig::f64::atan(half / aspect * shorter.max(0.0) / shorter.min(1.0)).to_degrees();
                (self.perspective(node, fov as f32), [half, half / aspect])
            }
            "orthographic" => {
                node.accept(&["focus_distance"]);
                (CameraKind::Orthographic { lens_radius: 0.0, focal_distance: 1e6 }, [1.0, 1.0 / aspect])
            }
            "spherical" => (CameraKind::Spherical { mapping: SphericalMapping::EquiRectangular }, [1.0; 2]),
            name if SENSORS.contains(&name) => {
                self.unsupported(node, "a perspective camera of 45 degrees stands in");
                let fov = FieldOfView { degrees: 45.0, axis: FovAxis::X };
                let half = half_width(&fov, aspect);
                (self.perspective(node, 45.0), [half, half / aspect])
            }
            _ => {
                self.unknown(node, &SENSORS);
                return;
            }
        };
        let offset =
            ["principal_point_offset_x", "principal_point_offset_y"].map(|n| self.float(node, n, 0.0));
        // The window that the kind's own unit is multiplied with: for a perspective, tan(fov/2).
        let unit = match kind {
            CameraKind::Perspective { fov, .. } => trig::f64::tan(f64::from(fov).to_radians() * 0.5),
            CameraKind::Orthographic { .. } | CameraKind::Realistic(_) | CameraKind::Spherical { .. } => 1.0,
        };
        let [x, y] = half.map(|h| (h / unit) as f32);
        let shift = [2.0 * x * offset[0], -2.0 * y * offset[1]];
        let window = [-x + shift[0], x + shift[0], -y + shift[1], y + shift[1]];
        let is_flat = !matches!(kind, CameraKind::Spherical { .. });
        let Some(mirror) = Transform::scale(DVec3::new(-1.0, 1.0, 1.0)) else { return };
        let place = |t: Transform| t * mirror;
        let world_from_camera =
            math::AnimatedTransform::new(place(to_world.start()), place(to_world.end()), to_world.times());
        self.scene.camera = CameraDesc {
            kind,
            world_from_camera,
            shutter_open: open,
            shutter_close: close.max(open),
            screen_window: is_flat.then_some(window),
            frame_aspect_ratio: None,
            medium,
            span: node.span,
        };
    }

    fn perspective(&mut self, node: &Node, fov: f32) -> CameraKind {
        let focal_distance = self.positive(node, "focus_distance", 1e4);
        let lens_radius =
            if node.kind == "thinlens" { self.positive(node, "aperture_radius", 0.1) } else { 0.0 };
        CameraKind::Perspective { fov, lens_radius, focal_distance, aperture: ApertureDesc::Disk }
    }

    /// `fov` along `fov_axis`, or a `focal_length` over a diagonal of 35 mm film.
    pub(super) fn field_of_view(&mut self, node: &Node) -> FieldOfView {
        let axis = match self.word(node, "fov_axis", &["x", "y", "diagonal", "smaller", "larger"]) {
            "y" => FovAxis::Y,
            "diagonal" => FovAxis::Diagonal,
            "smaller" => FovAxis::Smaller,
            "larger" => FovAxis::Larger,
            _ => FovAxis::X,
        };
        if let Some(fov) = self.float_opt(node, "fov") {
            if fov > 0.0 && fov < 180.0 {
                return FieldOfView { degrees: fov, axis };
            }
            let message = format!("a field of view of {fov} degrees");
            self.report.error(node.span_of("fov"), message).hint("expected 0 to 180");
        }
        let length = match node.find("focal_length").map(|p| &p.value) {
            Some(Value::Text(s)) => text::number(s.trim().trim_end_matches("mm")),
            Some(Value::Float(x)) => Some(*x),
            Some(Value::Integer(n)) => Some(*n as f64),
            Some(_) => None,
            None => Some(50.0),
        };
        let Some(length) = length.filter(|l| *l > 0.0) else {
            let at = node.span_of("focal_length");
            self.report.error(at, "this focal length is none").hint("expected millimetres, as in \"50mm\"");
            return FieldOfView { degrees: 45.0, axis };
        };
        let diagonal = f64::from(36 * 36 + 24 * 24).sqrt();
        let degrees = 2.0 * trig::f64::atan(diagonal / (2.0 * length)).to_degrees();
        FieldOfView { degrees: degrees as f32, axis: FovAxis::Diagonal }
    }

    /// Names what a spectral film would have that ours has not.
    fn spectral_bands(&mut self, node: &'t Node) {
        let of_objects = self.children(node).into_iter().filter(|(_, c, _)| c.class != Class::Filter);
        let mut names: Vec<_> = of_objects.map(|(p, ..)| p.name.as_str()).collect();
        let is_curve = |p: &&Prop| matches!(p.value, Value::Spectrum(_));
        names.extend(node.props.iter().filter(is_curve).map(|p| p.name.as_str()));
        self.report
            .warning(node.span, format!("the bands of film \"specfilm\" are not recorded: {}", names.join(", ")))
            .hint("the picture has R, G and B as the CIE observer sees them, as \"hdrfilm\" would; nothing else differs");
        node.accept_all();
    }

    fn film(&mut self, node: &'t Node) {
        if !matches!(node.kind.as_str(), "hdrfilm" | "ldrfilm" | "specfilm" | "mfilm" | "tiledhdrfilm") {
            self.unknown(node, &["hdrfilm", "specfilm", "ldrfilm"]);
        }
        if node.kind == "specfilm" {
            self.spectral_bands(node);
        }
        let size = [("width", 768), ("height", 576)].map(|(n, d)| self.count(node, n, d, 1..=1 << 16));
        let mut crop = None;
        if ["crop_width", "crop_height", "crop_offset_x", "crop_offset_y"].iter().any(|n| node.has(n)) {
            let x0 = self.count(node, "crop_offset_x", 0, 0..=i64::from(size[0]) - 1);
            let y0 = self.count(node, "crop_offset_y", 0, 0..=i64::from(size[1]) - 1);
            let w = self.count(node, "crop_width", size[0] - x0, 1..=i64::from(size[0] - x0));
            let h = self.count(node, "crop_height", size[1] - y0, 1..=i64::from(size[1] - y0));
            crop = Some([x0, x0 + w, y0, y0 + h]);
        }
        node.accept(&[
            "file_format",
            "pixel_format",
            "component_format",
            "sample_border",
            "compensate",
            "banner",
            "attach_log",
            "high_quality_edges",
            "fov_sensor",
            "tonemap_method",
            "gamma",
            "exposure",
        ]);
        self.scene.filter = FilterDesc::Gaussian { radius: [2.0; 2], sigma: 0.5 };
        for (_, child, _) in self.children(node) {
            match child.class {
                Class::Filter => self.filter(child),
                _ if node.kind == "specfilm" => {}
                _ => self.misplaced(child, node),
            }
        }
        self.unused(node);
        self.scene.film =
            FilmDesc { resolution: size, pixel_bounds: crop, span: node.span, ..FilmDesc::default() };
    }

    fn filter(&mut self, node: &'t Node) {
        self.scene.filter = match node.kind.as_str() {
            "box" => FilterDesc::Box { radius: [self.positive(node, "radius", 0.5); 2] },
            "tent" => FilterDesc::Triangle { radius: [self.positive(node, "radius", 1.0); 2] },
            "gaussian" => {
                let sigma = self.positive(node, "stddev", 0.5);
                FilterDesc::Gaussian { radius: [4.0 * sigma; 2], sigma }
            }
            "mitchell" => {
                let [b, c] = [("A", 1.0 / 3.0), ("B", 1.0 / 3.0)].map(|(n, d)| self.float(node, n, d));
                let b = self.float(node, "b", b);
                FilterDesc::Mitchell { radius: [2.0; 2], b, c: self.float(node, "c", c) }
            }
            "catmullrom" => FilterDesc::Mitchell { radius: [2.0; 2], b: 0.0, c: 0.5 },
            "lanczos" => {
                let lobes = self.count(node, "lobes", 3, 1..=16) as f32;
                FilterDesc::Sinc { radius: [lobes; 2], tau: lobes }
            }
            _ => {
                self.unknown(node, &FILTERS);
                return;
            }
        };
        self.unused(node);
    }

    fn sampler(&mut self, node: &'t Node) {
        let spp = self.count(node, "sample_count", DEFAULT_SPP, 1..=1 << 24);
        let seed = self.integer_opt(node, "seed").unwrap_or(0);
        node.accept(&["jitter", "strength", "scramble", "dimension", "wavelength_sampling"]);
        if !SAMPLERS.contains(&node.kind.as_str()) {
            self.unknown(node, &SAMPLERS);
        }
        let side = (1..=4096_u32).find(|s| s * s >= spp).unwrap_or(4096);
        let (name, spp, strata) = match node.kind.as_str() {
            // Whole squares, as in Mitsuba.
            "stratified" => ("stratified", side * side, [side, side]),
            // All other points are our Sobol points: they differ in noise alone (decision 0140).
            _ => ("sobol", spp, [4, 4]),
        };
        self.unused(node);
        self.scene.sampler =
            SamplerDesc { name: name.into(), spp, strata, seed: seed as u64, span: node.span };
    }
}
