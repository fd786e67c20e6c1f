//! What stands before `WorldBegin`.

use scene_desc::{ApertureDesc, CameraKind, ColorSpaceName, FilterDesc, SphericalMapping};

use super::params::Params;
use super::{WriteError, Writer, matrix};
use crate::apertures;

/// pbrt has no word for "no limit".
const DEEPEST: u32 = 1 << 20;

impl Writer<'_, '_, '_> {
    pub(super) fn options(&mut self) -> Result<(), WriteError> {
        self.line(0, "# Written by Steradian.\n");
        let space = match self.scene.film.color_space {
            ColorSpaceName::Srgb => "srgb",
            ColorSpaceName::DciP3 => "dci-p3",
            ColorSpaceName::Rec2020 => "rec2020",
            ColorSpaceName::Aces2065_1 => "aces2065-1",
        };
        if space != "srgb" {
            self.line(0, &format!("ColorSpace \"{space}\""));
        }
        if let Some([a, b]) = self.times {
            self.line(0, &format!("TransformTimes {a} {b}"));
        }
        if self.scene.sampler.seed != 0 {
            self.line(0, &format!("Option \"integer seed\" {}", self.scene.sampler.seed as i32));
        }
        self.film();
        self.filter();
        self.sampler();
        self.integrator();
        self.camera()
    }

    fn film(&mut self) {
        let film = &self.scene.film;
        let mut p = Params::default();
        p.integer("xresolution", film.resolution[0]);
        p.integer("yresolution", film.resolution[1]);
        if let Some(b) = film.pixel_bounds {
            p.put("integer", "pixelbounds", &format!("[ {} {} {} {} ]", b[0], b[1], b[2], b[3]));
        }
        if let Some(name) = &film.filename {
            p.string("filename", name);
        }
        p.float_unless("diagonal", film.diagonal_mm, 35.0);
        // Exposure is the shutter's time times the film's speed.
        let shutter = self.shutter();
        let iso = film.sensor.iso * film.sensor.exposure_time / (shutter[1] - shutter[0]);
        p.float_unless("iso", iso, 100.0);
        if let Some(kelvin) = film.sensor.white_balance {
            p.float("whitebalance", kelvin);
        }
        self.line(0, &format!("Film \"rgb\"{}", p.0));
    }

    /// When the shutter opens and closes: pbrt wants the one before the other.
    fn shutter(&self) -> [f32; 2] {
        let c = &self.scene.camera;
        if c.shutter_close > c.shutter_open {
            [c.shutter_open, c.shutter_close]
        } else {
            [c.shutter_open, c.shutter_open + 1.0]
        }
    }

    fn filter(&mut self) {
        let mut p = Params::default();
        let (name, radius) = match self.scene.filter {
            FilterDesc::Box { radius } => ("box", radius),
            FilterDesc::Triangle { radius } => ("triangle", radius),
            FilterDesc::Gaussian { radius, sigma } => {
                p.float("sigma", sigma);
                ("gaussian", radius)
            }
            FilterDesc::Mitchell { radius, b, c } => {
                p.float("B", b);
                p.float("C", c);
                ("mitchell", radius)
            }
            FilterDesc::Sinc { radius, tau } => {
                p.float("tau", tau);
                ("sinc", radius)
            }
        };
        p.float("xradius", radius[0]);
        p.float("yradius", radius[1]);
        self.line(0, &format!("PixelFilter \"{name}\"{}", p.0));
    }

    fn sampler(&mut self) {
        let s = &self.scene.sampler;
        let mut p = Params::default();
        let name = match s.name.as_str() {
            "stratified" => {
                p.integer("xsamples", s.strata[0]);
                p.integer("ysamples", s.strata[1]);
                "stratified"
            }
            other => {
                p.integer("pixelsamples", s.spp);
                if other == "independent" { "independent" } else { "zsobol" }
            }
        };
        self.line(0, &format!("Sampler \"{name}\"{}", p.0));
    }

    fn integrator(&mut self) {
        let i = &self.scene.integrator;
        let mut depth = i.max_depth.unwrap_or(DEEPEST);
        let name = match i.name.as_str() {
            "path" => "volpath",
            "direct" => {
                depth = depth.min(1);
                "volpath"
            }
            "light" => "lightpath",
            "bdpt" => "bdpt",
            "mlt" => "mlt",
            "sppm" => "sppm",
            "ao" => "ambientocclusion",
            other => {
                let what = format!("integrator \"{other}\"");
                self.otherwise(i.span, &what, "\"volpath\" is written: it gives the same picture in the end");
                "volpath"
            }
        };
        let mut p = Params::default();
        if name != "ambientocclusion" {
            p.integer("maxdepth", depth);
        }
        self.line(0, &format!("Integrator \"{name}\"{}", p.0));
    }

    /// Writes the shape of an opening; is there one, other than the disk?
    fn aperture(&self, p: &mut Params, shape: &ApertureDesc) -> Result<bool, WriteError> {
        let named = apertures::NAMES.into_iter().find(|n| apertures::named(n).as_ref() == Some(shape));
        match shape {
            ApertureDesc::Disk => return Ok(false),
            ApertureDesc::Image(path) => {
                let bytes =
                    std::fs::read(path).map_err(|source| WriteError::Io { path: path.clone(), source })?;
                let own = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                let name = self.file(&format!("aperture-{own}"), &bytes)?;
                p.string("aperture", &name);
            }
            ApertureDesc::Gaussian => p.string("aperture", "gaussian"),
            ApertureDesc::Polygon(_) if named.is_some() => p.string("aperture", named.unwrap_or_default()),
            ApertureDesc::Polygon(corners) => {
                let first = corners.first().map_or(0.0, |c| math::trig::atan2(c.y, c.x).to_degrees() - 90.0);
                p.integer("blades", corners.len() as u32);
                p.float_unless("rotation", first, 0.0);
            }
        }
        Ok(true)
    }

    #[allow(clippy::too_many_lines, reason = "one arm a kind")]
    fn camera(&mut self) -> Result<(), WriteError> {
        let c = &self.scene.camera;
        let mut p = Params::default();
        let name = match &c.kind {
            CameraKind::Perspective { fov, lens_radius, focal_distance, aperture } => {
                p.float("fov", *fov);
                if *lens_radius > 0.0 {
                    p.float("lensradius", *lens_radius);
                    p.float("focaldistance", *focal_distance);
                }
                if self.aperture(&mut p, aperture)? {
                    self.otherwise(
                        c.span,
                        "thin lens of such a shape",
                        "its parameters are an extension of ours",
                    );
                }
                "perspective"
            }
            CameraKind::Orthographic { lens_radius, focal_distance } => {
                if *lens_radius > 0.0 {
                    p.float("lensradius", *lens_radius);
                    p.float("focaldistance", *focal_distance);
                }
                "orthographic"
            }
            CameraKind::Realistic(stack) => {
                let line = |e: &scene_desc::LensElement| {
                    format!("{} {} {} {}\n", e.curvature, e.thickness, e.eta, e.aperture)
                };
                let text: String = stack.elements.iter().map(line).collect();
                let name = self.file("lens.dat", text.as_bytes())?;
                p.string("lensfile", &name);
                p.float("aperturediameter", stack.aperture_diameter);
                p.float("focusdistance", stack.focus_distance);
                self.aperture(&mut p, &stack.aperture)?;
                "realistic"
            }
            CameraKind::Spherical { mapping } => {
                p.string(
                    "mapping",
                    match mapping {
                        SphericalMapping::EqualArea => "equalarea",
                        SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
                            "equirectangular"
                        }
                    },
                );
                "spherical"
            }
        };
        let [open, close] = self.shutter();
        p.float_unless("shutteropen", open, 0.0);
        p.float_unless("shutterclose", close, 1.0);
        if let Some(w) = c.screen_window {
            p.floats("float", "screenwindow", w);
        }
        if let Some(ratio) = c.frame_aspect_ratio {
            p.float("frameaspectratio", ratio);
        }
        // The file has camera from world.
        let t = &c.world_from_camera;
        if t.is_animated() {
            self.line(0, "ActiveTransform StartTime");
            self.line(0, &matrix(&t.start().inverse()));
            self.line(0, "ActiveTransform EndTime");
            self.line(0, &matrix(&t.end().inverse()));
            self.line(0, "ActiveTransform All");
        } else {
            self.line(0, &matrix(&t.start().inverse()));
        }
        if let Some(id) = c.medium {
            self.line(0, &format!("MediumInterface \"\" \"medium-{}\"", id.0));
        }
        self.line(0, &format!("Camera \"{name}\"{}", p.0));
        Ok(())
    }
}
