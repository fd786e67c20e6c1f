//! Materials and lights of pbrt-v3, upgraded: what they show under an even sky, and where they shine, against what their
//! parameters mean there [PBR3e].

use std::f64::consts::PI;

use math::{Point, Vec3};
use scene::{LightContext, LightId, Scene};
use spectrum::Wavelengths;
use steradian_tests::{Eye, Family, Way};

const SKY: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
const SHEET: &str = "Shape \"disk\" \"float radius\" [9]\nWorldEnd\n";
const WAYS: [Way<'_>; 2] = [
    Way { integrator: "path", settings: &[("max_depth", "1")] },
    Way { integrator: "path", settings: &[("max_depth", "1"), ("shadow_rays", "false")] },
];

/// What a sheet of the material shows from the cosine `mu`, in an even world: its directional albedo.
fn sheet(mu: f64, material: &str) -> Scene {
    let eye = Eye::at([(1.0 - mu * mu).sqrt(), 0.0, mu], [0.0; 3], 128);
    eye.scene(&format!("{SKY}{material}\n{SHEET}"))
}

/// Reflectance of a dielectric of index 1.5.
fn fresnel(mu: f64) -> f64 {
    let eta = 1.5;
    let cos_t = (1.0 - (1.0 - mu * mu) / (eta * eta)).sqrt();
    let (s, p) = ((mu - eta * cos_t) / (mu + eta * cos_t), (eta * mu - cos_t) / (eta * mu + cos_t));
    0.5 * (s * s + p * p)
}

#[test]
fn sums_of_lobes() {
    let mut family = Family::default();
    for mu in [1.0, 0.4] {
        let f = fresnel(mu);
        // Into the denser side radiance grows by the index squared.
        let through = (1.0 - f) / (1.5 * 1.5);
        let cases = [
            ("matte", "\"rgb Kd\" [.4 .4 .4]", 0.4),
            (
                "translucent",
                "\"rgb Kd\" [.6 .6 .6] \"rgb Ks\" [0 0 0] \"rgb reflect\" [.7 .7 .7] \"rgb transmit\" [.2 .2 .2]",
                0.54,
            ),
            (
                "translucent",
                "\"rgb Kd\" [.3 .3 .3] \"rgb Ks\" [.4 .4 .4] \"rgb reflect\" [.7 .7 .7] \"rgb transmit\" [.5 .5 .5] \"float roughness\" 0.0001 \"bool remaproughness\" \"false\"",
                0.3 * 1.2 + 0.4 * (0.7 * f + 0.5 * through),
            ),
            (
                "uber",
                "\"rgb Kd\" [.2 .2 .2] \"rgb Ks\" [0 0 0] \"rgb Kr\" [.1 .1 .1] \"rgb Kt\" [.6 .6 .6]",
                0.2 + 0.1 * f + 0.6 * through,
            ),
            (
                "uber",
                "\"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0] \"rgb Kr\" [1 1 1] \"rgb Kt\" [1 1 1]",
                f + through,
            ),
            ("uber", "\"rgb Kd\" [.5 .5 .5] \"rgb Ks\" [0 0 0] \"rgb opacity\" [.4 .4 .4]", 0.4 * 0.5 + 0.6),
            ("mirror", "\"rgb Kr\" [.6 .6 .6]", 0.6),
        ];
        for (kind, parameters, expected) in cases {
            let scene = sheet(mu, &format!("Material \"{kind}\" {parameters}"));
            for (seed, way) in WAYS.iter().enumerate() {
                let what = format!("{kind} {parameters} at {mu}, {}", way.name());
                family.mean_within(what, &way.moments(&scene, 40 + seed as u64), expected, 1e-4);
            }
        }
    }
    family.finish();
}

/// Shares and opacities that a texture of colours gives count by its mean.
#[test]
fn colours_where_numbers_are_meant() {
    let mut family = Family::default();
    let texture = "Texture \"c\" \"color\" \"scale\" \"rgb tex1\" [.9 .6 .3] \"rgb tex2\" [.5 .5 .5]\n";
    let mixed = format!(
        "{texture}MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [.8 .8 .8]\n\
         MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [.2 .2 .2]\n\
         Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"texture amount\" \"c\""
    );
    let cut = format!(
        "{texture}Material \"uber\" \"rgb Kd\" [.5 .5 .5] \"rgb Ks\" [0 0 0] \"texture opacity\" \"c\""
    );
    for (what, material, expected) in
        [("mix", mixed, 0.3 * 0.8 + 0.7 * 0.2), ("opacity", cut, 0.3 * 0.5 + 0.7)]
    {
        let scene = sheet(0.7, &material);
        family.mean_within(what.to_owned(), &WAYS[0].moments(&scene, 5), expected, 1e-4);
    }
    family.finish();
}

/// `disney` as [PBR3e, sec. 9.2] and pbrt-v3 have it, where nothing passes.
#[derive(Clone, Copy)]
struct Disney {
    color: f64,
    metallic: f64,
    roughness: f64,
    anisotropic: f64,
    sheen: f64,
    clearcoat: f64,
    gloss: f64,
}

const PLAIN: Disney = Disney {
    color: 0.5,
    metallic: 0.0,
    roughness: 0.5,
    anisotropic: 0.0,
    sheen: 0.0,
    clearcoat: 0.0,
    gloss: 1.0,
};

fn schlick(cos: f64) -> f64 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Disney {
    fn text(&self) -> String {
        let Self { color: c, metallic, roughness, anisotropic, sheen, clearcoat, gloss } = self;
        format!(
            "Material \"disney\" \"rgb color\" [{c} {c} {c}] \"float metallic\" {metallic} \"float roughness\" {roughness} \
             \"float anisotropic\" {anisotropic} \"float sheen\" {sheen} \"float clearcoat\" {clearcoat} \
             \"float clearcoatgloss\" {gloss}"
        )
    }

    /// f(wo, wi) for directions on one side.
    fn f(&self, wo: [f64; 3], wi: [f64; 3]) -> f64 {
        let h = [wo[0] + wi[0], wo[1] + wi[1], wo[2] + wi[2]];
        let length = dot(h, h).sqrt();
        let h = h.map(|x| x / length);
        let d = dot(wi, h);
        let (fo, fi) = (schlick(wo[2]), schlick(wi[2]));
        let weight = 1.0 - self.metallic;
        let lambert = (1.0 - 0.5 * fo) * (1.0 - 0.5 * fi);
        let rr = 2.0 * self.roughness * d * d;
        let retro = rr * (fo + fi + fo * fi * (rr - 1.0));
        let base = weight * (self.color / PI * (lambert + retro) + self.sheen * schlick(d));

        let aspect = (1.0 - 0.9 * self.anisotropic).sqrt();
        let (ax, ay) = (self.roughness.powi(2) / aspect, self.roughness.powi(2) * aspect);
        let e = (h[0] / ax).powi(2) + (h[1] / ay).powi(2) + h[2] * h[2];
        let ggx = 1.0 / (PI * ax * ay * e * e);
        let g1 = |w: [f64; 3]| {
            let tan2 = ((w[0] * ax).powi(2) + (w[1] * ay).powi(2)) / (w[2] * w[2]);
            2.0 / (1.0 + (1.0 + tan2).sqrt())
        };
        let r0 = 0.04 * weight + self.color * self.metallic;
        let metal = r0 + (1.0 - r0) * schlick(d);
        let mirror = weight * fresnel(d) + self.metallic * metal;
        let specular = mirror * ggx * g1(wo) * g1(wi) / (4.0 * wo[2] * wi[2]);

        let a = 0.1 + self.gloss * (0.001 - 0.1);
        let gtr1 = (a * a - 1.0) / (PI * (a * a).ln() * (1.0 + (a * a - 1.0) * h[2] * h[2]));
        let smith = |cos: f64| 1.0 / (cos + (0.0625 + cos * cos - 0.0625 * cos * cos).sqrt());
        let coat = 0.25 * self.clearcoat * gtr1 * (0.04 + 0.96 * schlick(d)) * smith(wo[2]) * smith(wi[2]);
        base + specular + coat
    }

    /// Reflected share of an even light, by a rule of midpoints that are dense about the mirror direction.
    fn albedo(&self, mu: f64) -> f64 {
        let wo = [(1.0 - mu * mu).sqrt(), 0.0, mu];
        let n = 600;
        let mut sum = 0.0;
        // Over half vectors: θ_h by a square, so that narrow lobes are met.
        for i in 0..n {
            let x = (f64::from(i) + 0.5) / f64::from(n);
            let (theta, jacobian) = (0.5 * PI * x.powi(3), 1.5 * PI * x * x);
            for k in 0..n {
                let phi = 2.0 * PI * (f64::from(k) + 0.5) / f64::from(n);
                let h = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
                let d = dot(wo, h);
                let wi = [0, 1, 2].map(|c| 2.0 * d * h[c] - wo[c]);
                if d > 0.0 && wi[2] > 0.0 {
                    let cell = jacobian / f64::from(n) * 2.0 * PI / f64::from(n);
                    sum += self.f(wo, wi) * wi[2] * 4.0 * d * theta.sin() * cell;
                }
            }
        }
        sum
    }
}

#[test]
fn disneys_surface() {
    let mut family = Family::default();
    let cases = [
        ("plain", PLAIN),
        ("smooth", Disney { roughness: 0.2, ..PLAIN }),
        ("sheen", Disney { sheen: 0.8, ..PLAIN }),
        ("coat", Disney { clearcoat: 1.0, gloss: 0.3, ..PLAIN }),
        ("metal", Disney { metallic: 1.0, color: 0.8, anisotropic: 0.6, ..PLAIN }),
    ];
    for (name, disney) in cases {
        for mu in [0.9, 0.4] {
            let scene = sheet(mu, &disney.text());
            let expected = disney.albedo(mu);
            family.mean_within(format!("{name} at {mu}"), &WAYS[0].moments(&scene, 6), expected, 2e-3);
        }
    }
    family.finish();
}

/// A map of latitude and longitude, the first row towards the light's y axis.
#[test]
fn goniometric_lights_shine_where_their_map_says() {
    let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
    let (w, h) = (32, 16);
    // From 0.2 above to 1.2 below, and brighter towards +x.
    let value = |phi: f64, theta: f64| 0.2 + theta / PI + 0.3 * phi.cos();
    let pixels = (0..w * h).flat_map(|i| {
        let (x, y) = (f64::from(i % w) + 0.5, f64::from(i / w) + 0.5);
        [(value(x / f64::from(w) * 2.0 * PI, y / f64::from(h) * PI)) as f32; 3]
    });
    let map = image::Image::from_data(
        w as usize,
        h as usize,
        ["R", "G", "B"].map(String::from).to_vec(),
        pixels.collect(),
    );
    let saved =
        map.and_then(|m| image::save(&folder.path().join("map.pfm"), &m, &image::SaveOptions::default()));
    saved.unwrap_or_else(|e| panic!("{e}"));
    let text = format!(
        "{}LightSource \"goniometric\" \"rgb I\" [3 3 3] \"string mapname\" \"map.pfm\"\nShape \"sphere\"\nWorldEnd\n",
        Eye::on_floor(4).head()
    );
    let path = folder.path().join("a.pbrt");
    std::fs::write(&path, text).unwrap_or_else(|e| panic!("{e}"));
    let scene = steradian_tests::open(&path, &render::SceneOptions::default());
    let mut off = 0.0_f64;
    for i in 0..200 {
        let (z, phi) = (f64::from(i).mul_add(0.0099, -0.99), f64::from(i) * 2.4);
        let r = (1.0 - z * z).sqrt();
        let d = [r * phi.cos(), z, r * phi.sin()];
        let p = Point(Vec3::new(d[0] as f32, d[1] as f32, d[2] as f32) * 2.0);
        let context = LightContext { p, p_error: Vec3::ZERO, ng: None, ns: None, time: 0.0 };
        let s = scene.lights.sample(LightId(0), &context, [0.5; 2], &Wavelengths::RGB);
        let intensity = s.map_or(0.0, |s| f64::from(s.li.rgb()[0])) * 4.0;
        // Longitude runs from x towards z, the angle starts at y.
        let expected = 3.0 * value(d[2].atan2(d[0]), z.acos());
        off = off.max((intensity - expected).abs());
    }
    // Pixels of 16 × 32 are coarse: of a sixteenth of π.
    assert!(off < 0.3, "{off}");
}
