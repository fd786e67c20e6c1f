//! `<transform>`: its operations, the first applied first.

use math::{DMat4, DVec3, Transform};

use super::text;

/// Why an operation is none.
pub(super) struct Wrong {
    pub(super) message: String,
    pub(super) hint: &'static str,
}

fn wrong<T>(message: impl Into<String>, hint: &'static str) -> Result<T, Wrong> {
    Err(Wrong { message: message.into(), hint })
}

/// The operations.
pub(super) const OPERATIONS: [&str; 6] = ["translate", "rotate", "scale", "lookat", "matrix", "lookAt"];

/// The matrix of an operation. `get` gives an attribute, parameters put in.
pub(super) fn operation<'a>(name: &str, get: impl Fn(&str) -> Option<&'a str>) -> Result<DMat4, Wrong> {
    match name {
        "translate" => Ok(DMat4::from_translation(xyz(&get, 0.0)?)),
        "scale" => Ok(DMat4::from_scale(xyz(&get, 1.0)?)),
        "rotate" => {
            let axis = xyz(&get, 0.0)?;
            let Some(axis) = axis.try_normalize() else {
                return wrong("a rotation about no axis", "give x, y or z a value other than 0");
            };
            let angle = get("angle").unwrap_or_default();
            match text::number(angle) {
                Some(degrees) => Ok(DMat4::from_axis_angle(axis, degrees.to_radians())),
                None => wrong(
                    format!("angle \"{}\" is no number", text::show(angle)),
                    "expected degrees: angle=\"90\"",
                ),
            }
        }
        "lookat" | "lookAt" => look_at(&get),
        _ => matrix(get("value").unwrap_or_default()),
    }
}

/// `x`, `y` and `z`, or all of them in `value`.
fn xyz<'a>(get: &impl Fn(&str) -> Option<&'a str>, default: f64) -> Result<DVec3, Wrong> {
    let numbers = |s: &'a str| match text::numbers(s) {
        Ok(v) => Ok(v),
        Err(item) => wrong(format!("\"{}\" is no number", text::show(item)), "expected numbers"),
    };
    if let Some(all) = get("value") {
        return match numbers(all)?.as_slice() {
            [v] => Ok(DVec3::splat(*v)),
            [x, y, z] => Ok(DVec3::new(*x, *y, *z)),
            other => wrong(format!("{} numbers", other.len()), "expected one or three"),
        };
    }
    let mut v = DVec3::splat(default);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let Some(s) = get(name) else { continue };
        match numbers(s)?.as_slice() {
            [x] => v[axis] = *x,
            other => return wrong(format!("{} numbers in \"{name}\"", other.len()), "expected one"),
        }
    }
    Ok(v)
}

/// World from a space whose z looks at the target, x to the left and y up.
fn look_at<'a>(get: &impl Fn(&str) -> Option<&'a str>) -> Result<DMat4, Wrong> {
    let point = |name: &str| match get(name).map(text::numbers) {
        Some(Ok(v)) => match v.as_slice() {
            [x, y, z] => Ok(Some(DVec3::new(*x, *y, *z))),
            _ => wrong(format!("\"{name}\" has {} numbers", v.len()), "expected three"),
        },
        Some(Err(item)) => wrong(format!("\"{}\" is no number", text::show(item)), "expected numbers"),
        None => Ok(None),
    };
    let (Some(origin), Some(target)) = (point("origin")?, point("target")?) else {
        return wrong("lookat needs \"origin\" and \"target\"", "and has \"up\"");
    };
    let Some(dir) = (target - origin).try_normalize() else {
        return wrong("lookat from a point to itself", "\"origin\" and \"target\" must differ");
    };
    let up = point("up")?.filter(|u| *u != DVec3::ZERO).unwrap_or_else(|| dir.any_orthonormal_vector());
    let Some(left) = up.normalize_or_zero().cross(dir).try_normalize() else {
        return wrong("lookat along its own \"up\"", "choose another \"up\"");
    };
    let up = dir.cross(left);
    Ok(DMat4::from_cols(left.extend(0.0), up.extend(0.0), dir.extend(0.0), origin.extend(1.0)))
}

/// 16 or 9 numbers, row by row.
fn matrix(value: &str) -> Result<DMat4, Wrong> {
    let v = match text::numbers(value) {
        Ok(v) => v,
        Err(item) => return wrong(format!("\"{}\" is no number", text::show(item)), "expected numbers"),
    };
    let n = match v.len() {
        16 => 4,
        9 => 3,
        other => return wrong(format!("a matrix of {other} numbers"), "expected 16, row by row, or 9"),
    };
    let mut m = DMat4::IDENTITY;
    for row in 0..n {
        for column in 0..n {
            m.col_mut(column)[row] = v[row * n + column];
        }
    }
    Ok(m)
}

/// A matrix with its inverse.
pub(super) fn invertible(m: DMat4) -> Result<Transform, Wrong> {
    match Transform::from_matrix(m) {
        Some(t) => Ok(t),
        None => wrong("a transform without an inverse", "is a scale 0, or a matrix singular?"),
    }
}
