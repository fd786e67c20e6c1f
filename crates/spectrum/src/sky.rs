//! Daylight: radiance of the clear sky by direction, and of the sun.
//!
//! | what  | source                                                                                                   |
//! |-------|----------------------------------------------------------------------------------------------------------|
//! | sky   | fitted formula and RGB data [Hosek2012] (`data/hosek_wilkie`, under its authors' licence there)           |
//! | sun   | a black body of 5778 K, attenuated by air, haze and ozone on the way [Preetham1999]; an even disk         |
//! | place | [Blanco2001]                                                                                              |
//!
//! Radiance is linear sRGB in W m⁻² sr⁻¹ nm⁻¹: as bright as an even spectrum of that value. Left out: water vapour and
//! mixed gases before the sun (below 3 % of visible light), and the darkening of its limb.

use std::f64::consts::{FRAC_PI_2, PI};

use math::trig::f64 as trig;

use crate::{cie, planck};

/// Half the angle of the sun's disk as seen from Earth, in radians.
pub const SUN_RADIUS: f64 = 0.5 * 0.5358 * PI / 180.0;

/// Nine numbers at six elevations for each of ten turbidities, without and with a white ground; little-endian `f32`.
const SHAPES: [&[u8]; 3] = [
    include_bytes!("../data/hosek_wilkie/params-r"),
    include_bytes!("../data/hosek_wilkie/params-g"),
    include_bytes!("../data/hosek_wilkie/params-b"),
];
/// The same of mean radiance.
const SIZES: [&[u8]; 3] = [
    include_bytes!("../data/hosek_wilkie/radiances-r"),
    include_bytes!("../data/hosek_wilkie/radiances-g"),
    include_bytes!("../data/hosek_wilkie/radiances-b"),
];

/// A clear sky under a certain sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    shapes: [[f64; 9]; 3],
    sizes: [f64; 3],
}

impl Sky {
    /// With the sun `elevation` radians above the horizon, in [0, π/2]; haze by `turbidity` in [1, 10] (2 is clear, 10 is
    /// misty), over ground of this reflectance. What is outside is taken to the border.
    #[must_use]
    pub fn new(elevation: f64, turbidity: f64, albedo: [f64; 3]) -> Self {
        let t = trig::pow((elevation / FRAC_PI_2).clamp(0.0, 1.0), 1.0 / 3.0);
        let turbidity = turbidity.clamp(1.0, 10.0);
        let mut sky = Self { shapes: [[0.0; 9]; 3], sizes: [0.0; 3] };
        for c in 0..3 {
            let fit = |data: &[u8], stride: usize, i: usize| {
                blend(turbidity, albedo[c].clamp(0.0, 1.0), |row| {
                    bezier(data, row * 6 * stride + i, stride, t)
                })
            };
            sky.shapes[c] = std::array::from_fn(|i| fit(SHAPES[c], 9, i));
            sky.sizes[c] = fit(SIZES[c], 1, 0);
        }
        sky
    }

    /// Radiance from a direction with this cosine to the zenith and this one to the sun; none from below the horizon.
    #[must_use]
    pub fn radiance(&self, cos_zenith: f64, cos_sun: f64) -> [f64; 3] {
        if cos_zenith < 0.0 {
            return [0.0; 3];
        }
        let cos_sun = cos_sun.clamp(-1.0, 1.0);
        let gamma = trig::acos(cos_sun);
        std::array::from_fn(|i| {
            let [a, b, c, d, e, f, g, h, k] = self.shapes[i];
            let mie = (1.0 + cos_sun * cos_sun) / trig::pow(1.0 + k * k - 2.0 * k * cos_sun, 1.5);
            let horizon = 1.0 + a * trig::exp(b / (cos_zenith + 0.01));
            let glow = c + d * trig::exp(e * gamma) + f * cos_sun * cos_sun + g * mie + h * cos_zenith.sqrt();
            // Their data weigh radiance by the eye's curves, whose integral is not one.
            (self.sizes[i] * horizon * glow / cie::y_integral()).max(0.0)
        })
    }
}

/// Linear in turbidity and in the ground's reflectance between ten rows each.
fn blend(turbidity: f64, albedo: f64, row: impl Fn(usize) -> f64) -> f64 {
    let low = (turbidity as usize).clamp(1, 10);
    let high = (low + 1).min(10);
    let f = turbidity - low as f64;
    let at = |ground: usize| row(10 * ground + low - 1) * (1.0 - f) + row(10 * ground + high - 1) * f;
    at(0) * (1.0 - albedo) + at(1) * albedo
}

/// A Bézier curve of degree five.
fn bezier(data: &[u8], first: usize, stride: usize, t: f64) -> f64 {
    const BINOMIALS: [f64; 6] = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0];
    let number = |i: usize| {
        let bytes = data.get(4 * i..4 * i + 4).and_then(|b| <[u8; 4]>::try_from(b).ok());
        bytes.map_or(0.0, |b| f64::from(f32::from_le_bytes(b)))
    };
    let power = |x: f64, n: usize| (0..n).fold(1.0, |p, _| p * x);
    (0..6).map(|i| BINOMIALS[i] * power(t, i) * power(1.0 - t, 5 - i) * number(first + i * stride)).sum()
}

/// Radiance of the sun's disk through the air, at this elevation in radians.
#[must_use]
pub fn sun_radiance(elevation: f64, turbidity: f64) -> [f64; 3] {
    let zenith = (FRAC_PI_2 - elevation).clamp(0.0, FRAC_PI_2);
    // Relative optical mass [Preetham1999, appendix 1].
    let mass = 1.0 / (trig::cos(zenith) + 0.15 * trig::pow(93.885 - zenith.to_degrees(), -1.253));
    let beta = (0.046_08 * turbidity - 0.045_86).max(0.0);
    let mut xyz = [0.0; 3];
    let mut lambda = 380.0_f64;
    while lambda <= 780.0 {
        let um = lambda * 1e-3;
        let air = 0.008_735 * trig::pow(um, -4.08);
        let haze = beta * trig::pow(um, -1.3);
        let ozone = 0.35 * ozone(lambda);
        let radiance = planck(lambda, 5778.0) * trig::exp(-mass * (air + haze + ozone));
        let bar = cie::xyz_bar(lambda as f32);
        for (sum, bar) in xyz.iter_mut().zip(bar) {
            *sum += f64::from(bar) * radiance * 5.0;
        }
        lambda += 5.0;
    }
    let [x, y, z] = xyz.map(|v| v / cie::y_integral());
    // Linear sRGB of XYZ [IEC61966].
    [
        (3.240_97 * x - 1.537_383 * y - 0.498_611 * z).max(0.0),
        (-0.969_244 * x + 1.875_968 * y + 0.041_555 * z).max(0.0),
        (0.055_63 * x - 0.203_977 * y + 1.056_972 * z).max(0.0),
    ]
}

/// Absorption of ozone per centimetre, at 450 to 700 nm in steps of ten [Preetham1999, table 2].
fn ozone(lambda: f64) -> f64 {
    const TABLE: [f64; 26] = [
        0.003, 0.006, 0.009, 0.014, 0.021, 0.030, 0.040, 0.048, 0.063, 0.075, 0.085, 0.103, 0.120, 0.120,
        0.115, 0.125, 0.120, 0.105, 0.090, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023,
    ];
    let x = (lambda - 450.0) / 10.0;
    if !(0.0..=25.0).contains(&x) {
        return 0.0;
    }
    let i = (x as usize).min(24);
    let f = x - i as f64;
    TABLE[i] * (1.0 - f) + TABLE[i + 1] * f
}

/// Where and when the sun is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunTime {
    /// Degrees north and east.
    pub place: [f64; 2],
    /// Hours that clocks are ahead of Greenwich.
    pub timezone: f64,
    /// Year, month, day.
    pub date: [i64; 3],
    /// Hours since midnight.
    pub hour: f64,
}

impl SunTime {
    /// Elevation of the sun and its azimuth from north over east, in radians.
    #[must_use]
    pub fn position(&self) -> [f64; 2] {
        let hour = self.hour - self.timezone;
        let [year, month, day] = self.date;
        // Days since noon of 1 January 2000; in whole numbers as the almanac has it.
        let a = (month - 14) / 12;
        let julian = 1461 * (year + 4800 + a) / 4 + 367 * (month - 2 - 12 * a) / 12
            - 3 * ((year + 4900 + a) / 100) / 4
            + day
            - 32075;
        let d = julian as f64 - 0.5 + hour / 24.0 - 2_451_545.0;

        let omega = 2.1429 - 0.001_039_459_4 * d;
        let mean_longitude = 4.895_063 + 0.017_202_791_698 * d;
        let anomaly = 6.24006 + 0.017_201_969_9 * d;
        let longitude =
            mean_longitude + 0.033_416_07 * trig::sin(anomaly) + 0.000_348_94 * trig::sin(2.0 * anomaly)
                - 0.000_113_4
                - 0.000_020_3 * trig::sin(omega);
        let obliquity = 0.409_092_8 - 6.2140e-9 * d + 0.000_039_6 * trig::cos(omega);
        let (sin, cos) = (trig::sin(longitude), trig::cos(longitude));
        let right_ascension = trig::atan2(trig::cos(obliquity) * sin, cos);
        let declination = trig::asin(trig::sin(obliquity) * sin);

        let sidereal = 6.697_424_324_2 + 0.065_709_828_3 * d + hour;
        let local = (sidereal * 15.0 + self.place[1]).to_radians();
        let angle = local - right_ascension;
        let latitude = self.place[0].to_radians();
        let (sin_d, cos_d) = (trig::sin(declination), trig::cos(declination));
        let (sin_l, cos_l) = (trig::sin(latitude), trig::cos(latitude));
        let zenith = trig::acos((cos_l * trig::cos(angle) * cos_d + sin_d * sin_l).clamp(-1.0, 1.0));
        let azimuth = trig::atan2(-trig::sin(angle), sin_d / cos_d * cos_l - sin_l * trig::cos(angle));
        // The observer stands on the Earth, not in its centre.
        let parallax = 6371.01 / 149_597_890.0 * trig::sin(zenith);
        [FRAC_PI_2 - zenith - parallax, azimuth]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sky_is_blue_brighter_near_the_sun_and_dark_below() {
        let sky = Sky::new(0.8, 3.0, [0.3; 3]);
        let up = sky.radiance(1.0, trig::sin(0.8));
        assert!(up[2] > up[1] && up[1] > up[0] && up[0] > 0.0, "{up:?}");
        let near = sky.radiance(trig::sin(0.8), 0.999);
        assert!(near[0] > 3.0 * up[0], "{near:?} {up:?}");
        assert_eq!(sky.radiance(-0.1, 0.0), [0.0; 3]);
        // Illuminance of a clear sky without sun: some ten thousand lux.
        let n = 200;
        let mut lux = 0.0;
        for i in 0..n {
            let z = (f64::from(i) + 0.5) / f64::from(n);
            for j in 0..n {
                let phi = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(n);
                let cos = (1.0 - z * z).sqrt() * trig::cos(0.8) * trig::cos(phi) + z * trig::sin(0.8);
                let [r, g, b] = sky.radiance(z, cos);
                lux += z * (0.2126 * r + 0.7152 * g + 0.0722 * b);
            }
        }
        lux *= 2.0 * PI / f64::from(n * n) * cie::y_integral() * 683.0;
        assert!((6e3..4e4).contains(&lux), "{lux}");
    }

    #[test]
    fn the_sun_gives_a_hundred_thousand_lux_and_is_red_when_it_sets() {
        let lux = |elevation: f64| {
            let [r, g, b] = sun_radiance(elevation, 3.0);
            let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
            y * PI * SUN_RADIUS * SUN_RADIUS * cie::y_integral() * 683.0
        };
        assert!((6e4..1.3e5).contains(&lux(1.2)), "{}", lux(1.2));
        let [r, g, b] = sun_radiance(0.05, 3.0);
        assert!(r > 2.0 * g && g > 2.0 * b, "{r} {g} {b}");
        assert!(lux(0.05) < 0.1 * lux(1.2));
    }

    #[test]
    fn noon_is_in_the_south() {
        // Equinox on the equator at Greenwich: overhead about noon.
        let at = |place, hour| SunTime { place, timezone: 0.0, date: [2015, 3, 20], hour }.position();
        assert!(at([0.0, 0.0], 12.12)[0] > 1.56, "{:?}", at([0.0, 0.0], 12.12));
        let [elevation, azimuth] = at([45.0, 0.0], 12.12);
        assert!(
            (elevation - PI / 4.0).abs() < 0.01 && (azimuth.abs() - PI).abs() < 0.01,
            "{elevation} {azimuth}"
        );
        // It rises in the east.
        let [elevation, azimuth] = at([45.0, 0.0], 6.12);
        assert!(elevation.abs() < 0.02 && (azimuth - FRAC_PI_2).abs() < 0.02, "{elevation} {azimuth}");
    }
}
