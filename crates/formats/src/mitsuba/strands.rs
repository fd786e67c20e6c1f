//! Strands of curves: `bsplinecurve`, `linearcurve`, and `hair` of version 0.6.
//!
//! Radii are those of the file whatever `to_world` does to the points.

use std::sync::Arc;

use math::{AnimatedTransform, Vec3};
use scene_desc::{CurveDesc, CurveKind, Geometry};

use super::build::Build;
use super::shapes::Form;
use super::text;
use super::tree::Node;
use crate::source;

/// A point and the radius there.
type Point = [f32; 4];

impl<'t> Build<'t, '_, '_> {
    pub(super) fn curves(
        &mut self,
        node: &'t Node,
        world_from_object: &AnimatedTransform,
    ) -> Option<Vec<Form>> {
        let Some(name) = self.string(node, "filename") else {
            let hint = "add <string name=\"filename\" value=\"…\"/>";
            return self.refuse(node.span, format!("{} has no \"filename\"", node.title()), hint);
        };
        let (path, span) = (node.resolve(&name), node.span_of("filename"));
        let source = match source::read(&path) {
            Ok(source) => source,
            Err(e) => return self.refuse(span, format!("{} cannot be read: {e}", path.display()), e.hint()),
        };
        self.hashes.push(source.hash);

        let is_hair = node.kind == "hair";
        let parsed = if is_hair {
            let radius = self.float(node, "radius", 0.025);
            // Both would leave points out.
            node.accept(&["angle_threshold", "reduction"]);
            match source.bytes.strip_prefix(b"BINARY_HAIR") {
                Some(rest) => Ok(binary_hair(rest, radius)),
                None => lines(&source.bytes, Some(radius)),
            }
        } else {
            lines(&source.bytes, None)
        };
        let mut strands = match parsed {
            Ok(strands) => strands,
            Err((line, what)) => {
                let message = format!("{}:{line}: no control point: {what}", path.display());
                return self.refuse(span, message, "expected x y z radius (of hair, x y z)");
            }
        };

        // A strand's width grows by the mean scale: it is made smaller by as much.
        let m = world_from_object.start().matrix();
        let grows = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate().length()).iter().sum::<f64>() / 3.0;
        if grows > 0.0 {
            strands.iter_mut().flatten().for_each(|p| p[3] /= grows as f32);
        }
        strands.retain(|s| !s.is_empty());
        let degree = if node.kind == "bsplinecurve" { 3 } else { 1 };
        let short = strands.iter().filter(|s| s.len() <= degree).count();
        if short > 0 {
            let message = format!("{short} strands of {} have too few points", path.display());
            self.report
                .warning(span, message)
                .hint(format!("they are left out: at least {} are needed", degree + 1));
        }
        let long = strands.iter().filter(|s| s.len() > degree);
        Some(long.flat_map(|s| strand(s, degree)).map(Form::plain).collect())
    }
}

/// A point a line, with its radius where none is given, strands apart by empty lines; or the line that is none.
fn lines(bytes: &[u8], radius: Option<f32>) -> Result<Vec<Vec<Point>>, (usize, String)> {
    let content = String::from_utf8_lossy(bytes);
    let mut strands: Vec<Vec<Point>> = vec![Vec::new()];
    for (i, line) in content.lines().enumerate() {
        if line.trim().is_empty() {
            strands.push(Vec::new());
            continue;
        }
        let point = match (text::numbers(line).as_deref(), radius) {
            (Ok([x, y, z, r]), None) if *r >= 0.0 => [*x as f32, *y as f32, *z as f32, *r as f32],
            (Ok([x, y, z]), Some(r)) => [*x as f32, *y as f32, *z as f32, r],
            (_, _) => return Err((i + 1, text::show(line))),
        };
        strands.last_mut().into_iter().for_each(|s| s.push(point));
    }
    Ok(strands)
}

/// A count of points, then their coordinates; an infinite number starts a new strand. What is not finite beside that ends the file.
fn binary_hair(bytes: &[u8], radius: f32) -> Vec<Vec<Point>> {
    let mut numbers = bytes
        .get(4..)
        .unwrap_or_default()
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let mut strands: Vec<Vec<Point>> = vec![Vec::new()];
    while let Some(x) = numbers.next() {
        if x == f32::INFINITY {
            strands.push(Vec::new());
            continue;
        }
        let (Some(y), Some(z)) = (numbers.next(), numbers.next()) else { break };
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            break;
        }
        strands.last_mut().into_iter().for_each(|s| s.push([x, y, z, radius]));
    }
    strands
}

/// A strand as Bézier segments: all of them together where the radius does not change, else each by itself.
fn strand(points: &[[f32; 4]], degree: usize) -> Vec<Geometry> {
    let at = |p: &[f32; 4]| Vec3::new(p[0], p[1], p[2]);
    let segments: Vec<([Vec3; 4], [f32; 2])> = points
        .windows(degree + 1)
        .map(|w| {
            let p: Vec<Vec3> = w.iter().map(at).collect();
            if degree == 1 {
                let (a, b) = (p[0], p[1]);
                return ([a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b], [w[0][3], w[1][3]]);
            }
            // The uniform B-spline's Bézier points, and its radius at both ends.
            let (a, b, c, d) = (p[0], p[1], p[2], p[3]);
            let bezier =
                [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0];
            let radius = |i: usize| (w[i][3] + 4.0 * w[i + 1][3] + w[i + 2][3]) / 6.0;
            (bezier, [radius(0), radius(1)])
        })
        .collect();
    let first = segments[0].1[0];
    let curve = |segments: Vec<[Vec3; 4]>, radii: [f32; 2]| {
        let width = radii.map(|r| 2.0 * r);
        Geometry::Curve(Arc::new(CurveDesc {
            segments,
            kind: CurveKind::Cylinder,
            width,
            normals: Vec::new(),
        }))
    };
    if segments.iter().all(|(_, r)| r.iter().all(|r| (r - first).abs() <= 1e-6 * first)) {
        return vec![curve(segments.iter().map(|s| s.0).collect(), [first; 2])];
    }
    segments.into_iter().map(|(points, radii)| curve(vec![points], radii)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hair_is_read_as_text_and_as_numbers() {
        let points =
            [[0.0_f32, 0.0, 0.0], [0.0, 1.0, 0.0], [f32::INFINITY; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]];
        let mut bytes = 4_u32.to_le_bytes().to_vec();
        for p in points {
            let n = if p[0].is_infinite() { 1 } else { 3 };
            bytes.extend(p[..n].iter().flat_map(|x| x.to_le_bytes()));
        }
        let binary = binary_hair(&bytes, 0.5);
        assert_eq!(
            binary,
            [
                vec![[0.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.5]],
                vec![[1.0, 0.0, 0.0, 0.5], [1.0, 2.0, 0.0, 0.5]]
            ]
        );
        assert_eq!(lines(b"0 0 0\n0 1 0\n\n1 0 0\n1 2 0\n", Some(0.5)), Ok(binary));
        assert_eq!(lines(b"0 0 0 1\n0 1 0\n", None), Err((2, "0 1 0".to_owned())));
        assert!(binary_hair(&bytes[..9], 0.5).concat().is_empty());
    }
}
