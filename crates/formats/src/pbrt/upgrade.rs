//! Scenes of pbrt-v3 [PBR3e], upgraded on the way: what differs in names alone is given pbrt-v4's, after which it is built as
//! such. Materials are built from their own parameters (see `old_materials`).
//!
//! | of pbrt-v3             | here                                                                                   |
//! |------------------------|----------------------------------------------------------------------------------------|
//! | film, filter, sampler  | the same under new names; a film's `scale` as film speed                                |
//! | `directlighting`, `whitted` | `path` with one scattering event, as pbrt-v4's own upgrade has it                    |
//! | infinite lights        | latitude and longitude; `L` scales the map                                             |
//! | goniometric lights     | their map of latitude and longitude becomes one of equal areas                         |
//! | colours as `scale`     | a factor on the light's own colour                                                     |
//! | quadrics beyond spheres, disks, cylinders; `nurbs`, `heightfield` | left out, with a warning                    |

use std::rc::Rc;
use std::sync::Arc;

use math::trig;
use scene_desc::{ColorSpaceName, Span};

use super::params::{ParamList, Params, Type, Values};
use super::state::{Entities, Entity};
use crate::report::Report;

/// Rewrites all that differs.
pub(super) fn upgrade(all: &mut Entities, report: &mut Report<'_>) {
    if let Some(film) = &mut all.film {
        upgrade_film(film);
    }
    upgrade_filter(all);
    if let Some(sampler) = &mut all.sampler {
        match sampler.kind.as_str() {
            "02sequence" | "lowdiscrepancy" | "zerotwosequence" | "maxmindist" => {
                sampler.kind = "paddedsobol".into();
            }
            "random" => sampler.kind = "independent".into(),
            _ => {}
        }
        for name in ["dimensions", "samplepixelcenter", "scramble"] {
            sampler.params.remove(name);
        }
    }
    if let Some(integrator) = &mut all.integrator {
        upgrade_integrator(integrator, report);
    }
    if let Some(camera) = &mut all.camera {
        if camera.entity.kind == "environment" {
            camera.entity.kind = "spherical".into();
            camera.entity.params.set_word("mapping", "equirectangular", camera.entity.span);
        }
        camera.entity.params.remove("simpleweighting");
    }
    for light in &mut all.lights {
        upgrade_light(&mut light.entity, report);
    }
    for light in &mut all.area_lights {
        if light.kind == "area" {
            light.kind = "diffuse".into();
        }
        size_of_light(light, "L", report);
    }
    for medium in &mut all.media {
        if medium.entity.kind == "heterogeneous" {
            medium.entity.kind = "uniformgrid".into();
        }
    }
    for texture in &mut all.textures {
        upgrade_texture(&mut texture.entity);
    }
    for shape in &mut all.shapes {
        upgrade_shape(&mut shape.entity);
    }
    all.shapes.retain(|s| {
        let kind = s.entity.kind.as_str();
        let is_left_out = matches!(kind, "cone" | "paraboloid" | "hyperboloid" | "heightfield" | "nurbs");
        if is_left_out {
            report
                .warning(s.entity.span, format!("shape \"{kind}\" is not supported"))
                .hint("it is left out: make a mesh of it");
        }
        !is_left_out
    });
}

/// One number of a parameter, of any of these types.
fn number(p: &Params, name: &str) -> Option<f32> {
    match p.peek(name)?.floats() {
        [x] => Some(*x),
        [r, g, b] if r == g && g == b => Some(*r),
        _ => None,
    }
}

fn upgrade_film(film: &mut Entity) {
    if film.kind == "image" {
        film.kind = "rgb".into();
    }
    if let Some(scale) = number(&film.params, "scale").filter(|s| *s > 0.0) {
        film.params.set_float("iso", 100.0 * scale, film.span);
    }
    for name in ["scale", "maxsampleluminance"] {
        film.params.remove(name);
    }
}

/// A box where none is given; [PBR3e]'s default radii.
fn upgrade_filter(all: &mut Entities) {
    let filter = all.filter.get_or_insert_with(|| Entity {
        kind: "box".into(),
        params: Params::new(ParamList::default(), Rc::default(), ColorSpaceName::Srgb),
        ctm: Arc::clone(&super::state::GraphicsState::default().ctm),
        span: Span::NONE,
    });
    if filter.kind == "lanczossinc" {
        filter.kind = "sinc".into();
    }
    let (span, p) = (filter.span, &mut filter.params);
    p.rename("xwidth", "xradius");
    p.rename("ywidth", "yradius");
    if filter.kind == "gaussian" {
        // exp(-alpha d²).
        let alpha = number(p, "alpha").filter(|a| *a > 0.0).unwrap_or(2.0);
        p.remove("alpha");
        p.set_float("sigma", (0.5 / alpha).sqrt(), span);
        for name in ["xradius", "yradius"] {
            if p.peek(name).is_none() {
                p.set_float(name, 2.0, span);
            }
        }
    }
}

fn upgrade_integrator(integrator: &mut Entity, report: &mut Report<'_>) {
    let span = integrator.span;
    if matches!(integrator.kind.as_str(), "directlighting" | "whitted") {
        let message = format!("integrator \"{}\" is rendered as \"path\" of depth 1", integrator.kind);
        report.warning(span, message).hint("`--set max_depth=N` follows mirrors and glass deeper");
        integrator.kind = "path".into();
        integrator.params.set(Type::Integer, "maxdepth", Values::Integers(vec![1]), span);
    }
    let p = &mut integrator.params;
    if let Some(strategy) = p.remove("lightsamplestrategy") {
        let new = match strategy.strings() {
            [s] if s == "uniform" || s == "power" => s.clone(),
            _ => "bvh".to_owned(),
        };
        p.set_word("lightsampler", &new, span);
    }
    for name in [
        "rrthreshold",
        "pixelbounds",
        "strategy",
        "iterations",
        "numiterations",
        "imagewritefrequency",
        "nsamples",
    ] {
        p.remove(name);
    }
}

fn upgrade_light(light: &mut Entity, report: &mut Report<'_>) {
    let size = if matches!(light.kind.as_str(), "distant" | "infinite") { "L" } else { "I" };
    light.params.rename("mapname", "filename");
    if light.kind == "exinfinite" {
        light.kind = "infinite".into();
    }
    if light.kind == "projection" && light.params.peek("fov").is_none() {
        light.params.set_float("fov", 45.0, light.span);
    }
    size_of_light(light, size, report);
    // Goniometric lights have a size of their own beside the map.
    let has_map = light.params.peek("filename").is_some() && light.kind != "goniometric";
    if has_map && let Some(tint) = light.params.remove(size) {
        let (scale, even) = match tint.floats() {
            [r, g, b] => ((r + g + b) / 3.0, r == g && g == b),
            [x] if tint.ty != Type::Blackbody => (*x, true),
            _ => (1.0, false),
        };
        if !even {
            report
                .warning(tint.span, format!("\"{size}\" colours the light's map"))
                .hint("its mean is used as a factor");
        }
        let before = number(&light.params, "scale").unwrap_or(1.0);
        light.params.set_float("scale", before * scale, light.span);
    }
}

/// `scale` may be a colour, and black bodies have a factor of their own.
fn size_of_light(light: &mut Entity, size: &str, report: &mut Report<'_>) {
    let (span, p) = (light.span, &mut light.params);
    for name in ["nsamples", "samples", "shadowmapname"] {
        p.remove(name);
    }
    let mut factor = 1.0;
    if let Some(body) = p.peek(size).filter(|b| b.ty == Type::Blackbody)
        && let [kelvin, scale] = *body.floats()
    {
        factor = scale;
        p.set(Type::Blackbody, size, Values::Floats(vec![kelvin]), span);
    }
    let Some(scale) = p.remove("scale") else {
        if factor != 1.0 {
            p.set_float("scale", factor, span);
        }
        return;
    };
    match *scale.floats() {
        [s] => p.set_float("scale", s * factor, span),
        [r, g, b] => {
            let own = match p.peek(size).map(|o| (o.ty, o.floats())) {
                None => Some([1.0; 3]),
                Some((Type::Rgb, &[x, y, z])) => Some([x, y, z]),
                Some(_) => None,
            };
            match own {
                Some([x, y, z]) => p.set(Type::Rgb, size, Values::Floats(vec![x * r, y * g, z * b]), span),
                None => {
                    if r != g || g != b {
                        report
                            .warning(scale.span, "a light's \"scale\" is a colour")
                            .hint("its mean is used as a factor");
                    }
                    p.set_float("scale", factor * (r + g + b) / 3.0, span);
                }
            }
        }
        _ => {}
    }
}

fn upgrade_texture(texture: &mut Entity) {
    let (span, p) = (texture.span, &mut texture.params);
    if texture.kind == "imagemap" {
        let trilinear = p.remove("trilinear").is_some_and(|t| t.values == Values::Bools(vec![true]));
        if p.peek("filter").is_none() {
            p.set_word("filter", if trilinear { "trilinear" } else { "ewa" }, span);
        }
        if let Some(gamma) = p.remove("gamma") {
            let is_encoded = match &gamma.values {
                Values::Bools(b) => b == &[true],
                Values::Floats(_) | Values::Integers(_) | Values::Strings(_) => true,
            };
            p.set_word("encoding", if is_encoded { "sRGB" } else { "linear" }, span);
        }
    }
    p.remove("aamode");
}

fn upgrade_shape(shape: &mut Entity) {
    let p = &mut shape.params;
    if p.peek("uv").is_none() {
        p.rename("st", "uv");
    }
    p.retype("uv", Type::Float, Type::Point2);
    p.rename("nlevels", "levels");
    for name in ["shadowalpha", "discarddegenerateUVs", "scheme"] {
        p.remove(name);
    }
}

/// From pbrt-v3's roughness to the width of microfacets [PBR3e, sec. 8.4.2].
pub(super) fn alpha_of_roughness(roughness: f32) -> f32 {
    let x = trig::ln(roughness.max(1e-3));
    1.621_42 + x * (0.819_955 + x * (0.173_4 + x * (0.017_120_1 + x * 0.000_640_711)))
}
