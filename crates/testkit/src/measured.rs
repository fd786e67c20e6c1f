//! Tables of measured surfaces whose answers are known: a function of two directions, tabulated as the RGL data base
//! tabulates its measurements [Dupuy2018], and the bytes of such a file.

use std::f32::consts::{FRAC_PI_2, PI};

use math::{LocalDir, Vec3, trig};
use scatter::{MeasuredError, MeasuredParts, MeasuredTable, Raster};

/// Nodes of a slice along each axis, and of the polar angle of the outgoing direction.
const N: usize = 32;
const N_THETA: usize = 10;

/// A direction by polar angle and azimuth.
fn direction([theta, phi]: [f32; 2]) -> Vec3 {
    let ((s, c), (sp, cp)) = (trig::sin_cos(theta), trig::sin_cos(phi));
    Vec3::new(s * cp, s * sp, c)
}

/// GGX's density of normals, of these widths.
fn ggx(alpha: [f32; 2], m: Vec3) -> f32 {
    let v = Vec3::new(m.x / alpha[0], m.y / alpha[1], m.z);
    let l2 = v.length_squared();
    1.0 / (PI * alpha[0] * alpha[1] * l2 * l2)
}

/// The area of its facets, projected along `o`.
fn area(alpha: [f32; 2], o: Vec3) -> f32 {
    0.5 * (o.z + Vec3::new(alpha[0] * o.x, alpha[1] * o.y, o.z).length())
}

fn u(i: usize) -> f32 {
    i as f32 / (N - 1) as f32
}

/// Values at all nodes of a square.
fn square(f: impl Fn([f32; 2]) -> f32) -> impl Iterator<Item = f32> {
    let values: Vec<f32> = (0..N * N).map(|k| f([u(k % N), u(k / N)])).collect();
    values.into_iter()
}

/// What a table of channels of `f(wo, wi) cos θi` looks like, for half vectors distributed about as GGX's of these widths;
/// one quarter of all azimuths is tabulated where the widths differ.
///
/// # Errors
///
/// Those of [`MeasuredTable::new`].
pub fn tabulate<const C: usize>(
    alpha: [f32; 2],
    jacobian: bool,
    f_cos: impl Fn(LocalDir, LocalDir) -> [f32; C],
) -> Result<MeasuredParts, MeasuredError> {
    let size = [N, N];
    let theta_i: Vec<f32> = (0..N_THETA)
        .map(|i| (i as f32 / (N_THETA - 1) as f32).powi(2) * FRAC_PI_2)
        .map(|theta| theta.min(89.9_f32.to_radians()))
        .collect();
    let isotropic = alpha[0] == alpha[1];
    let phi_i: Vec<f32> = match isotropic {
        true => vec![0.0],
        false => (0..5).map(|i| -PI + FRAC_PI_2 * i as f32 / 4.0).collect(),
    };
    let angles = |u: [f32; 2]| [u[0] * u[0] * FRAC_PI_2, (2.0 * u[1] - 1.0) * PI];
    let outgoing: Vec<[f32; 2]> =
        phi_i.iter().flat_map(|phi| theta_i.iter().map(|theta| [*theta, *phi])).collect();
    let visible = |o: Vec3, u: [f32; 2]| {
        let m = direction(angles(u));
        ggx(alpha, m) * o.dot(m).max(0.0) * u[0] * trig::sin(angles(u)[0])
    };
    let mut parts = MeasuredParts {
        ndf: Raster { size, values: square(|u| ggx(alpha, direction(angles(u)))).collect() },
        sigma: Raster { size, values: square(|u| area(alpha, direction(angles(u)))).collect() },
        vndf: Raster {
            size,
            values: outgoing.iter().flat_map(|o| square(|u| visible(direction(*o), u))).collect(),
        },
        luminance: Raster { size, values: vec![1.0; outgoing.len() * N * N] },
        spectra: Raster { size, values: vec![1.0; outgoing.len() * N * N] },
        n_channels: 1,
        jacobian,
        phi_i,
        theta_i,
    };
    let warp = MeasuredTable::new(parts.clone())?;

    // What is seen at each node of the warped squares.
    let (mut luminance, mut spectra) = (Vec::new(), Vec::new());
    for &[theta, phi] in &outgoing {
        let o = direction([theta, phi]);
        let at = |s: [f32; 2]| {
            let [theta_m, phi_m] = warp.half_vector(phi, theta, s);
            let m = direction([theta_m, if isotropic { phi_m + phi } else { phi_m }]);
            let wi = m * (2.0 * m.dot(o)) - o;
            let scale = if jacobian { 4.0 * area(alpha, o) / ggx(alpha, m) } else { 1.0 };
            match wi.z > 1e-4 {
                true => f_cos(LocalDir(o), LocalDir(wi)).map(|x| x * scale),
                false => [0.0; C],
            }
        };
        luminance.extend(square(|s| at(s).iter().sum::<f32>()));
        for c in 0..C {
            spectra.extend(square(|s| at(s)[c]));
        }
    }
    parts.luminance.values = luminance;
    parts.spectra.values = spectra;
    parts.n_channels = C;
    Ok(parts)
}

/// The bytes of a file that holds these parts: as `spectra` at these wavelengths in nm, or as `rgb` where there are none.
#[must_use]
pub fn file(parts: &MeasuredParts, wavelengths: &[f32]) -> Vec<u8> {
    let floats = |v: &[f32]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let (phi, theta) = (parts.phi_i.len(), parts.theta_i.len());
    let sliced = |r: &Raster| vec![phi, theta, r.size[1], r.size[0]];
    let mut of_channel = sliced(&parts.spectra);
    of_channel.insert(2, parts.n_channels);
    let single = |r: &Raster| vec![r.size[1], r.size[0]];
    let mut fields: Vec<(&str, u8, Vec<usize>, Vec<u8>)> = vec![
        ("description", 1, vec![4], b"made".to_vec()),
        ("phi_i", 10, vec![phi], floats(&parts.phi_i)),
        ("theta_i", 10, vec![theta], floats(&parts.theta_i)),
        ("ndf", 10, single(&parts.ndf), floats(&parts.ndf.values)),
        ("sigma", 10, single(&parts.sigma), floats(&parts.sigma.values)),
        ("vndf", 10, sliced(&parts.vndf), floats(&parts.vndf.values)),
        ("luminance", 10, sliced(&parts.luminance), floats(&parts.luminance.values)),
        ("jacobian", 1, vec![1], vec![u8::from(parts.jacobian)]),
    ];
    let measured = floats(&parts.spectra.values);
    if wavelengths.is_empty() {
        fields.push(("rgb", 10, of_channel, measured));
    } else {
        fields.push(("spectra", 10, of_channel, measured));
        fields.push(("wavelengths", 10, vec![wavelengths.len()], floats(wavelengths)));
    }
    tensor_file(&fields)
}

/// A tensor file: name, type (1 for bytes, 10 for floats), shape and data of each field.
#[must_use]
pub fn tensor_file(fields: &[(&str, u8, Vec<usize>, Vec<u8>)]) -> Vec<u8> {
    let header: usize = 18 + fields.iter().map(|f| 2 + f.0.len() + 2 + 1 + 8 + 8 * f.2.len()).sum::<usize>();
    let mut bytes = b"tensor_file\0\x01\x00".to_vec();
    bytes.extend((fields.len() as u32).to_le_bytes());
    let mut offset = header;
    for (name, kind, shape, data) in fields {
        bytes.extend((name.len() as u16).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(*kind);
        bytes.extend((offset as u64).to_le_bytes());
        shape.iter().for_each(|n| bytes.extend((*n as u64).to_le_bytes()));
        offset += data.len();
    }
    fields.iter().for_each(|f| bytes.extend(&f.3));
    bytes
}
