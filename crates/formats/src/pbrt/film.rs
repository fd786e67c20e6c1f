//! `Film` and `PixelFilter`.

use scene_desc::{FilmDesc, FilterDesc, SensorDesc};

use super::build::Build;
use super::params::{Params, Type, Values};
use super::state::Entity;
use crate::suggest;

/// Pixels along one side.
const LONGEST_SIDE: u32 = 1 << 16;
/// Pixels in all: a film of more would not fit into memory.
const MOST_PIXELS: u64 = 1 << 28;

impl Build<'_, '_> {
    pub(super) fn film(&mut self, film: Option<&Entity>) {
        let mut desc = FilmDesc::default();
        let camera = &self.scene.camera;
        desc.sensor.exposure_time = camera.shutter_close - camera.shutter_open;
        if let Some(entity) = film {
            self.read_film(entity, &mut desc);
        }
        self.scene.film = desc;
    }

    fn read_film(&mut self, entity: &Entity, desc: &mut FilmDesc) {
        let (p, span) = (&entity.params, entity.span);
        desc.span = span;
        desc.color_space = p.space;
        match entity.kind.as_str() {
            "rgb" => {}
            "gbuffer" => {
                p.accept(&[("coordinatesystem", Type::String)]);
                self.report
                    .warning(span, "film \"gbuffer\" is not supported")
                    .hint("film \"rgb\" is used: the picture is the same, without the other channels");
            }
            "spectral" => {
                p.accept(&[
                    ("nbuckets", Type::Integer),
                    ("lambdamin", Type::Float),
                    ("lambdamax", Type::Float),
                ]);
                self.report.warning(span, "film \"spectral\" is not supported").hint("film \"rgb\" is used");
            }
            "image" => {
                super::parser::old_syntax(self.report, span, "film \"image\"", "\"rgb\"");
                return;
            }
            name => {
                let hint = suggest::hint(name, &["rgb", "gbuffer", "spectral"]);
                self.report.error(span, format!("unknown film \"{name}\"")).hint(hint);
                return;
            }
        }
        self.resolution(p, entity, desc);
        desc.pixel_bounds = self.pixel_bounds(p, desc.resolution);
        desc.filename = p.string_opt("filename", self.report).map(|f| f.0);
        desc.diagonal_mm = p.float("diagonal", 35.0, self.report);
        desc.sensor = self.sensor(p, desc.sensor.exposure_time);
        p.accept(&[("savefp16", Type::Bool)]);
        if let Some(limit) = p.float_opt("maxcomponentvalue", self.report) {
            let at = p.span_of("maxcomponentvalue").unwrap_or(span);
            self.report
                .warning(at, format!("\"maxcomponentvalue\" {limit} is ignored"))
                .hint("it would make the picture darker than it is; samples are not clamped");
        }
        p.report_unused(&format!("film \"{}\"", entity.kind), self.report);
    }

    fn resolution(&mut self, p: &Params, entity: &Entity, desc: &mut FilmDesc) {
        let x = p.count("xresolution", 1280, 1..=LONGEST_SIDE, self.report);
        let y = p.count("yresolution", 720, 1..=LONGEST_SIDE, self.report);
        if u64::from(x) * u64::from(y) > MOST_PIXELS {
            let message = format!("a film of {x} by {y} pixels");
            self.report
                .error(entity.span, message)
                .hint(format!("at most {MOST_PIXELS} pixels are possible"));
        } else {
            desc.resolution = [x, y];
        }
    }

    /// The crop, in pixels: x₀, x₁, y₀, y₁.
    fn pixel_bounds(&mut self, p: &Params, [x, y]: [u32; 2]) -> Option<[u32; 4]> {
        let crop = p.four_floats("cropwindow", self.report);
        let bounds = p.find("pixelbounds", &[Type::Integer]);
        let span = p.span_of(if crop.is_some() { "cropwindow" } else { "pixelbounds" }).unwrap_or_default();
        let (pixels, given) = if let Some(c) = crop {
            if bounds.is_some() {
                self.report
                    .warning(span, "both \"cropwindow\" and \"pixelbounds\" are given")
                    .hint("\"cropwindow\" is used, as in pbrt");
            }
            let at = |c: f32, n: u32| (n as f32 * c.clamp(0.0, 1.0)).ceil() as i64;
            let (x0, x1) = (c[0].min(c[1]), c[0].max(c[1]));
            let (y0, y1) = (c[2].min(c[3]), c[2].max(c[3]));
            ([at(x0, x), at(x1, x), at(y0, y), at(y1, y)], format!("\"cropwindow\" {c:?}"))
        } else {
            let Values::Integers(v) = &bounds?.values else { return None };
            let Ok(b) = <[i32; 4]>::try_from(v.as_slice()) else {
                let message = format!("\"pixelbounds\" has {} values", v.len());
                return self.refuse(span, message, "it takes four: x0 x1 y0 y1");
            };
            let cut = |v: i32, n: u32| i64::from(v).clamp(0, i64::from(n));
            ([cut(b[0], x), cut(b[1], x), cut(b[2], y), cut(b[3], y)], format!("\"pixelbounds\" {b:?}"))
        };
        if pixels[0] >= pixels[1] || pixels[2] >= pixels[3] {
            return self.refuse(span, format!("{given} leaves no pixel"), "expected x0 x1 y0 y1");
        }
        Some(pixels.map(|v| u32::try_from(v).unwrap_or(0)))
    }

    fn sensor(&mut self, p: &Params, shutter: f32) -> SensorDesc {
        let name = p.string_opt("sensor", self.report);
        let iso = p.float("iso", 100.0, self.report);
        let white = p.float("whitebalance", 0.0, self.report);
        let mut exposure_time = shutter;
        if let Some(time) = p.float_opt("exposuretime", self.report) {
            let at = p.span_of("exposuretime").unwrap_or_default();
            self.report
                .warning(at, "\"exposuretime\" is from before pbrt-v4's release")
                .hint("it is used in place of the camera's shutter times");
            exposure_time = time;
        }
        if let Some((name, span)) = name.as_ref().filter(|(n, _)| n != "cie1931") {
            self.report
                .warning(*span, format!("sensor \"{name}\" is not supported"))
                .hint("cie1931 is used, with the same exposure: colours differ");
        }
        for (name, value) in [("iso", iso), ("exposuretime", exposure_time)] {
            if value <= 0.0 {
                let at = p.span_of(name).unwrap_or_default();
                self.report.error(at, format!("\"{name}\" is {value}")).hint("it must be above 0");
            }
        }
        let white_balance = (white != 0.0).then_some(white);
        SensorDesc { name: "cie1931".into(), iso, exposure_time, white_balance }
    }

    pub(super) fn filter(&mut self, filter: Option<&Entity>) {
        let Some(entity) = filter else { return };
        let p = &entity.params;
        let radius = match entity.kind.as_str() {
            "box" => 0.5,
            "gaussian" => 1.5,
            "mitchell" | "triangle" => 2.0,
            "sinc" => 4.0,
            name => {
                let names = ["box", "gaussian", "mitchell", "sinc", "triangle"];
                let hint = suggest::hint(name, &names);
                self.report.error(entity.span, format!("unknown filter \"{name}\"")).hint(hint);
                return;
            }
        };
        for old in ["xwidth", "ywidth"] {
            if let Some(span) = p.span_of(old) {
                super::parser::old_syntax(
                    self.report,
                    span,
                    &format!("\"{old}\""),
                    "\"xradius\", \"yradius\"",
                );
                return;
            }
        }
        let radius = [p.float("xradius", radius, self.report), p.float("yradius", radius, self.report)];
        if radius.iter().any(|r| !(*r > 0.0 && *r <= 16.0)) {
            let at = p.span_of("xradius").or(p.span_of("yradius")).unwrap_or(entity.span);
            let message = format!("a filter of radius {} by {}", radius[0], radius[1]);
            self.report.error(at, message).hint("expected above 0 and at most 16 pixels");
        }
        let positive = |name, default, this: &mut Self| {
            let value = p.float(name, default, this.report);
            if value <= 0.0 {
                let at = p.span_of(name).unwrap_or_default();
                this.report.error(at, format!("\"{name}\" is {value}")).hint("it must be above 0");
            }
            value
        };
        self.scene.filter = match entity.kind.as_str() {
            "box" => FilterDesc::Box { radius },
            "triangle" => FilterDesc::Triangle { radius },
            "gaussian" => FilterDesc::Gaussian { radius, sigma: positive("sigma", 0.5, self) },
            "mitchell" => FilterDesc::Mitchell {
                radius,
                b: p.float("B", 1.0 / 3.0, self.report),
                c: p.float("C", 1.0 / 3.0, self.report),
            },
            _ => FilterDesc::Sinc { radius, tau: positive("tau", 3.0, self) },
        };
        p.report_unused(&format!("filter \"{}\"", entity.kind), self.report);
    }
}
