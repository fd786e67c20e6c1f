//! `Shape "curve"`: Bézier and uniform B-spline curves of degree 2 and 3, all as cubic Bézier segments.
//!
//! A B-spline's Bézier points are its polar form at the ends of the knot span [Ramshaw1989]; a quadratic is raised
//! to a cubic by q₀, (q₀ + 2 q₁)/3, (2 q₁ + q₂)/3, q₂.

use std::sync::Arc;

use math::Vec3;
use scene_desc::{CurveDesc, CurveKind, Geometry};

use super::build::Build;
use super::params::{Params, Type};
use super::state::Entity;
use crate::suggest;

impl Build<'_, '_> {
    pub(super) fn curve(&mut self, entity: &Entity) -> Option<Geometry> {
        let p = &entity.params;
        let width = p.float("width", 1.0, self.report);
        let width = [p.float("width0", width, self.report), p.float("width1", width, self.report)];
        if width.iter().any(|w| *w < 0.0) {
            let message = format!("a curve of width {} to {}", width[0], width[1]);
            self.report.error(entity.span, message).hint("widths must not be negative");
        }
        // pbrt splits curves for its tree, and so do we, by our own measure.
        p.accept(&[("splitdepth", Type::Integer)]);
        let degree = p.integer_opt("degree", self.report).unwrap_or((3, entity.span));
        let basis = p.string_opt("basis", self.report).unwrap_or(("bezier".into(), entity.span));
        let points = p.vec3s("P", Type::Point3);
        let at = p.span_of("P").unwrap_or(entity.span);
        let segments = match (basis.0.as_str(), degree.0) {
            ("bezier", 2) => chain::<3>(&points, 2).map(|s| s.map(|q| raise(*q)).collect::<Vec<_>>()),
            ("bezier", 3) => chain::<4>(&points, 3).map(|s| s.copied().collect()),
            ("bspline", 2) => Some(windows::<3>(&points).map(quadratic_spline).collect()),
            ("bspline", 3) => Some(windows::<4>(&points).map(cubic_spline).collect()),
            ("bezier" | "bspline", n) => {
                return self.refuse(degree.1, format!("a curve of degree {n}"), "possible are 2 and 3");
            }
            (name, _) => {
                let hint = suggest::hint(name, &["bezier", "bspline"]);
                return self.refuse(basis.1, format!("unknown basis \"{name}\""), hint);
            }
        };
        let segments = segments.filter(|s| !s.is_empty());
        let Some(segments) = segments else {
            let d = degree.0;
            let hint = match basis.0.as_str() {
                "bezier" => format!("expected {} + n × {d}", d + 1),
                _ => format!("expected at least {}", d + 1),
            };
            let message = format!("a {} curve of degree {d} with {} control points", basis.0, points.len());
            return self.refuse(at, message, hint);
        };
        let kind = self.curve_kind(p)?;
        let normals = self.curve_normals(entity, kind, segments.len())?;
        Some(Geometry::Curve(Arc::new(CurveDesc { segments, kind, width, normals })))
    }

    fn curve_kind(&mut self, p: &Params) -> Option<CurveKind> {
        let Some((name, span)) = p.string_opt("type", self.report) else { return Some(CurveKind::Flat) };
        match name.as_str() {
            "flat" => Some(CurveKind::Flat),
            "cylinder" => Some(CurveKind::Cylinder),
            "ribbon" => Some(CurveKind::Ribbon),
            _ => {
                let hint = suggest::hint(&name, &["flat", "cylinder", "ribbon"]);
                self.refuse(span, format!("unknown curve type \"{name}\""), hint)
            }
        }
    }

    fn curve_normals(&mut self, entity: &Entity, kind: CurveKind, n_segments: usize) -> Option<Vec<Vec3>> {
        let normals = entity.params.vec3s("N", Type::Normal);
        let at = entity.params.span_of("N").unwrap_or(entity.span);
        if kind != CurveKind::Ribbon {
            if !normals.is_empty() {
                self.report
                    .warning(at, "normals of a curve that is no ribbon")
                    .hint("they are ignored, as in pbrt; ribbons have \"string type\" \"ribbon\"");
            }
            return Some(Vec::new());
        }
        if normals.len() != n_segments + 1 {
            let message = format!("a ribbon of {n_segments} segments with {} normals", normals.len());
            return self.refuse(at, message, format!("expected {}", n_segments + 1));
        }
        Some(normals)
    }
}

/// Overlapping windows as arrays.
fn windows<const N: usize>(points: &[Vec3]) -> impl Iterator<Item = &[Vec3; N]> {
    points.windows(N).filter_map(|w| w.try_into().ok())
}

/// Bézier segments that share their ends; `None` if points are left over.
fn chain<const N: usize>(points: &[Vec3], degree: usize) -> Option<impl Iterator<Item = &[Vec3; N]>> {
    let fits = points.len() > degree && (points.len() - 1).is_multiple_of(degree);
    fits.then(|| windows::<N>(points).step_by(degree))
}

fn raise([a, b, c]: [Vec3; 3]) -> [Vec3; 4] {
    [a, (a + 2.0 * b) / 3.0, (2.0 * b + c) / 3.0, c]
}

fn quadratic_spline(&[a, b, c]: &[Vec3; 3]) -> [Vec3; 4] {
    raise([(a + b) / 2.0, b, (b + c) / 2.0])
}

fn cubic_spline(&[a, b, c, d]: &[Vec3; 4]) -> [Vec3; 4] {
    [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bezier([a, b, c, d]: [Vec3; 4], t: f32) -> Vec3 {
        let s = 1.0 - t;
        a * s * s * s + 3.0 * b * s * s * t + 3.0 * c * s * t * t + d * t * t * t
    }

    #[test]
    fn segments_follow_the_curve_that_they_replace() {
        let p = [Vec3::ZERO, Vec3::new(1.0, 2.0, 0.0), Vec3::new(3.0, -1.0, 1.0), Vec3::new(4.0, 0.0, 2.0)];
        for t in [0.0_f32, 0.3, 0.7, 1.0] {
            let (s, t2, t3) = (1.0 - t, t * t, t * t * t);
            let quadratic = p[0] * s * s + 2.0 * p[1] * s * t + p[2] * t2;
            assert!(bezier(raise([p[0], p[1], p[2]]), t).distance(quadratic) < 1e-5);
            // The uniform B-splines' basis functions.
            let two = (p[0] * s * s + p[1] * (1.0 + 2.0 * t - 2.0 * t2) + p[2] * t2) / 2.0;
            assert!(bezier(quadratic_spline(&[p[0], p[1], p[2]]), t).distance(two) < 1e-5);
            let three = (p[0] * s * s * s
                + p[1] * (3.0 * t3 - 6.0 * t2 + 4.0)
                + p[2] * (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0)
                + p[3] * t3)
                / 6.0;
            assert!(bezier(cubic_spline(&p), t).distance(three) < 1e-5);
        }
    }
}
