//! `Camera`: perspective, orthographic, spherical, realistic.

use scene_desc::{ApertureDesc, CameraDesc, CameraKind, LensElement, LensStackDesc, SphericalMapping};

use super::build::Build;
use super::params::{Params, Type};
use super::state::{Entity, PlacedEntity};
use crate::{apertures, source, suggest};

const NAMES: [&str; 4] = ["perspective", "orthographic", "spherical", "realistic"];

impl Build<'_, '_> {
    pub(super) fn camera(&mut self, camera: Option<&PlacedEntity>, film: Option<&Entity>) {
        let Some(PlacedEntity { entity, medium }) = camera else { return };
        let (p, span) = (&entity.params, entity.span);
        let kind = match entity.kind.as_str() {
            "perspective" => self.perspective(p),
            "orthographic" => {
                let (lens_radius, focal_distance) = self.lens(p);
                CameraKind::Orthographic { lens_radius, focal_distance }
            }
            "spherical" => self.spherical(p),
            "realistic" => match self.realistic(entity, film) {
                Some(kind) => kind,
                None => return,
            },
            "environment" => {
                super::parser::old_syntax(self.report, span, "camera \"environment\"", "\"spherical\"");
                return;
            }
            name => {
                let hint = suggest::hint(name, &NAMES);
                self.report.error(span, format!("unknown camera \"{name}\"")).hint(hint);
                return;
            }
        };
        let shutter_open = p.float("shutteropen", 0.0, self.report);
        let shutter_close = p.float("shutterclose", 1.0, self.report);
        if shutter_close <= shutter_open {
            let at = p.span_of("shutterclose").or(p.span_of("shutteropen")).unwrap_or(span);
            let message =
                format!("the shutter closes at {shutter_close}, not after it opens at {shutter_open}");
            self.report.error(at, message).hint("\"shutterclose\" must be above \"shutteropen\"");
        }
        let frame_aspect_ratio = p.float_opt("frameaspectratio", self.report);
        if let Some(bad) = frame_aspect_ratio.filter(|a| *a <= 0.0) {
            let at = p.span_of("frameaspectratio").unwrap_or(span);
            self.report.error(at, format!("\"frameaspectratio\" is {bad}")).hint("it must be above 0");
        }
        let screen_window = p.four_floats("screenwindow", self.report);
        if let Some([x0, x1, y0, y1]) = screen_window.filter(|w| w[0] == w[1] || w[2] == w[3]) {
            let at = p.span_of("screenwindow").unwrap_or(span);
            let message = format!("\"screenwindow\" [ {x0} {x1} {y0} {y1} ] is empty");
            self.report.error(at, message).hint("expected x0 x1 y0 y1");
        }
        p.report_unused(&format!("camera \"{}\"", entity.kind), self.report);
        let medium = self.medium(medium);
        self.scene.camera = CameraDesc {
            kind,
            world_from_camera: entity.ctm.inverse().animated(),
            shutter_open,
            shutter_close,
            screen_window,
            frame_aspect_ratio,
            medium,
            span,
        };
    }

    fn perspective(&mut self, p: &Params) -> CameraKind {
        let (lens_radius, focal_distance) = self.lens(p);
        let mut fov = p.float("fov", 90.0, self.report);
        if let Some(half) = p.float_opt("halffov", self.report).filter(|h| *h > 0.0) {
            fov = 2.0 * half;
        }
        if !(fov > 0.0 && fov < 180.0) {
            let at = p.span_of("fov").or(p.span_of("halffov")).unwrap_or_default();
            self.report.error(at, format!("a field of view of {fov} degrees")).hint("expected 0 to 180");
            fov = 90.0;
        }
        CameraKind::Perspective { fov, lens_radius, focal_distance, aperture: self.aperture(p) }
    }

    /// The shape of an opening: pbrt's names for its lens stacks, or an image; of ours are "blades" and "rotation", and
    /// both for thin lenses too.
    fn aperture(&mut self, p: &Params) -> ApertureDesc {
        let blades = p.integer_opt("blades", self.report);
        let rotation = p.float("rotation", 0.0, self.report);
        let (name, span) = p.string_opt("aperture", self.report).unwrap_or_default();
        if let Some((n, at)) = blades {
            let shape = u32::try_from(n).ok().and_then(|n| ApertureDesc::blades(n, rotation));
            return shape.unwrap_or_else(|| {
                self.report.error(at, format!("{n} blades")).hint("a lens has three of them, or more");
                ApertureDesc::Disk
            });
        }
        if name.is_empty() || name == "circular" {
            return ApertureDesc::Disk;
        }
        if let Some(shape) = apertures::named(&name) {
            return shape;
        }
        let path = self.resolve(&name);
        match source::hash(&path) {
            Ok(hash) => self.hashes.push(hash),
            Err(e) => {
                let message = format!("aperture {} cannot be read: {e}", path.display());
                let hint = "expected \"gaussian\", \"square\", \"pentagon\", \"star\" or an image";
                self.report.error(span, message).hint(hint);
            }
        }
        ApertureDesc::Image(path)
    }

    /// Lens radius and distance of focus.
    fn lens(&mut self, p: &Params) -> (f32, f32) {
        let radius = p.float("lensradius", 0.0, self.report);
        let distance = p.float("focaldistance", 1e6, self.report);
        if radius < 0.0 {
            let at = p.span_of("lensradius").unwrap_or_default();
            self.report.error(at, format!("\"lensradius\" is {radius}")).hint("it must not be negative");
        }
        if distance <= 0.0 {
            let at = p.span_of("focaldistance").unwrap_or_default();
            self.report.error(at, format!("\"focaldistance\" is {distance}")).hint("it must be above 0");
        }
        (radius, distance)
    }

    fn spherical(&mut self, p: &Params) -> CameraKind {
        // pbrt reads a lens here and does not use it.
        p.accept(&[("lensradius", Type::Float), ("focaldistance", Type::Float)]);
        let mapping = match p.string_opt("mapping", self.report) {
            None => SphericalMapping::EqualArea,
            Some((name, span)) => match name.as_str() {
                "equalarea" => SphericalMapping::EqualArea,
                "equirectangular" => SphericalMapping::EquiRectangular,
                _ => {
                    let hint = suggest::hint(&name, &["equalarea", "equirectangular"]);
                    self.report.error(span, format!("unknown mapping \"{name}\"")).hint(hint);
                    SphericalMapping::EqualArea
                }
            },
        };
        CameraKind::Spherical { mapping }
    }

    /// pbrt's lens files have four numbers a line: radius, thickness, index, diameter, the lengths in mm.
    fn realistic(&mut self, entity: &Entity, film: Option<&Entity>) -> Option<CameraKind> {
        let p = &entity.params;
        let Some((file, span)) = p.string_opt("lensfile", self.report) else {
            let hint = "add \"string lensfile\" \"…\"";
            return self.refuse(entity.span, "camera \"realistic\" has no \"lensfile\"", hint);
        };
        let path = self.base.join(&file);
        let source = match source::read(&path) {
            Ok(source) => source,
            Err(e) => {
                return self.refuse(span, format!("{} cannot be read: {e}", path.display()), e.hint());
            }
        };
        self.hashes.push(source.hash);
        let text = String::from_utf8_lossy(&source.bytes).into_owned();
        let lines = text.lines().map(|l| l.split('#').next().unwrap_or_default());
        let words = lines.flat_map(str::split_ascii_whitespace);
        let numbers: Option<Vec<f32>> =
            words.map(|w| w.parse().ok().filter(|x: &f32| x.is_finite())).collect();
        let whole = |n: &Vec<f32>| !n.is_empty() && n.len().is_multiple_of(4);
        let Some(numbers) = numbers.filter(whole) else {
            let hint = "expected four numbers a line: radius, thickness, index, diameter";
            return self.refuse(span, format!("{} is no lens file", path.display()), hint);
        };
        let element = |c: &[f32]| LensElement { curvature: c[0], thickness: c[1], eta: c[2], aperture: c[3] };
        Some(CameraKind::Realistic(LensStackDesc {
            elements: numbers.chunks_exact(4).map(element).collect(),
            aperture_diameter: p.float("aperturediameter", 1.0, self.report),
            focus_distance: p.float("focusdistance", 10.0, self.report),
            diagonal_mm: film.map_or(35.0, |f| f.params.float("diagonal", 35.0, self.report)),
            aperture: self.aperture(p),
        }))
    }
}
