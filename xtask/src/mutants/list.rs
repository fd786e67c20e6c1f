//! The mistakes that are planted, one at a time, and the tests that should find them.

/// A mistake: one place of one file, changed.
pub(crate) struct Mutant {
    /// For the command line and the table.
    pub(crate) name: &'static str,
    /// What is wrong then, in words.
    pub(crate) mistake: &'static str,
    /// From the root of the tree.
    pub(crate) file: &'static str,
    /// Stands exactly once in the file …
    pub(crate) from: &'static str,
    /// … and is replaced by this.
    pub(crate) to: &'static str,
    /// Any of these should fail.
    pub(crate) tests: &'static [Tests],
}

/// Tests of one binary.
#[derive(Clone, Copy)]
pub(crate) struct Tests {
    /// Of which package.
    pub(crate) package: &'static str,
    /// What comes between `cargo test -p PACKAGE` and `--`.
    pub(crate) target: &'static [&'static str],
    /// Only those whose name contains one of these; all if empty.
    pub(crate) filters: &'static [&'static str],
}

const fn agreement(filters: &'static [&'static str]) -> Tests {
    Tests { package: "steradian-integrators", target: &["--test", "agreement"], filters }
}

const fn unit(package: &'static str, filters: &'static [&'static str]) -> Tests {
    Tests { package, target: &["--lib"], filters }
}

const fn of(
    package: &'static str,
    target: &'static [&'static str],
    filters: &'static [&'static str],
) -> Tests {
    Tests { package, target, filters }
}

const DIRECT: &str = "crates/integrators/src/common/direct.rs";
const ENDS: &str = "crates/integrators/src/common/ends.rs";
const WALK: &str = "crates/integrators/src/common/walk.rs";
const SUBPATH: &str = "crates/integrators/src/common/subpath.rs";
const PATH: &str = "crates/integrators/src/path.rs";
const BDPT: &str = "crates/integrators/src/bdpt/mod.rs";
const MLT_BLOCK: &str = "crates/integrators/src/mlt/block.rs";

/// All of them, by what they are about.
pub(crate) const MUTANTS: &[Mutant] = &[
    // ---- what the integrand is ----
    Mutant {
        name: "no-cosine",
        mistake: "no cosine in next-event estimation",
        file: DIRECT,
        from: "let reflected = f * sample.li * wi.abs_cos_theta();",
        to: "let reflected = f * sample.li;",
        tests: &[agreement(&["large_lamp"])],
    },
    Mutant {
        name: "verdict-no-cosine",
        mistake: "the same, to be found by the laboratory's verdict",
        file: DIRECT,
        from: "let reflected = f * sample.li * wi.abs_cos_theta();",
        to: "let reflected = f * sample.li;",
        tests: &[of("steradian-lab", &["--test", "verdicts"], &["methods_that_are_right_agree"])],
    },
    Mutant {
        name: "no-eta-squared",
        mistake: "no η² for importance: light walks scatter as camera walks do",
        file: WALK,
        from: "DirectionSampling::Bsdf.sample(bsdf, wo, sampler, self.mode)",
        to: "DirectionSampling::Bsdf.sample(bsdf, wo, sampler, TransportMode::Radiance)",
        tests: &[agreement(&["on_rough_glass"])],
    },
    Mutant {
        name: "no-shading-normal-walk",
        mistake: "no shading-normal factor in light walks",
        file: WALK,
        from: "let correction = wo.abs_cos_theta() * ng.abs_dot(dir) / (ng.abs_dot(back) * s.wi.abs_cos_theta());",
        to: "let correction = 1.0_f32;",
        tests: &[agreement(&["shading_normals"])],
    },
    Mutant {
        name: "no-shading-normal-connection",
        mistake: "no shading-normal factor at connections",
        file: "crates/integrators/src/common/site.rs",
        from: "if cos_g > 0.0 { f * factor } else",
        to: "if cos_g + factor > 0.0 { f * wi.abs_cos_theta() } else",
        tests: &[agreement(&["shading_normals"])],
    },
    Mutant {
        name: "unpaid-roulette",
        mistake: "roulette without payment",
        file: "crates/integrators/src/common/roulette.rs",
        from: "(u < q).then(|| 1.0 / q)",
        to: "(u < q).then_some(1.0)",
        tests: &[unit("steradian-integrators", &["roulette"]), agreement(&[])],
    },
    Mutant {
        name: "bounce-path",
        mistake: "one bounce too few in `path`",
        file: PATH,
        from: "if walk.depth >= self.max_depth {",
        to: "if walk.depth + 1 >= self.max_depth {",
        tests: &[agreement(&["large_lamp"])],
    },
    Mutant {
        name: "bounce-bdpt",
        mistake: "one bounce too few in `bdpt`",
        file: BDPT,
        from: "paths.events(s, t) > depth {",
        to: "paths.events(s, t) >= depth {",
        tests: &[agreement(&["large_lamp"])],
    },
    Mutant {
        name: "bounce-light",
        mistake: "one bounce too many in `light`",
        file: "crates/integrators/src/light.rs",
        from: "limit: self.max_depth as usize,",
        to: "limit: self.max_depth as usize + 1,",
        tests: &[agreement(&[])],
    },
    Mutant {
        name: "frozen-light-paths",
        mistake: "light paths of `bdpt` all at the shutter's opening",
        file: BDPT,
        from: "let time = paths.eye_start.map_or(0.0, |c| c.start.ray.time);",
        to: "let time = 0.0;",
        tests: &[agreement(&["lens_and_motion"])],
    },
    Mutant {
        name: "unpaid-wavelengths",
        mistake: "dispersion ends three wavelengths of a branch, the fourth is not paid for",
        file: "crates/integrators/src/recursive.rs",
        from: "[4.0 * incoming.lanes()[0], 0.0, 0.0, 0.0]",
        to: "[incoming.lanes()[0], 0.0, 0.0, 0.0]",
        tests: &[agreement(&["in_wavelengths"])],
    },
    // ---- with what probability it was sampled ----
    Mutant {
        name: "light-pick-walks",
        mistake: "light walks start by power, weighted as if uniformly",
        file: ENDS,
        from: "let throughput = sample.throughput() / chosen;",
        to: "let throughput = sample.throughput() * scene.lights.ids().count() as f32;",
        tests: &[agreement(&["many_lamps", "points_and_spots"])],
    },
    Mutant {
        name: "light-pick-direct",
        mistake: "next-event estimation picks by importance, weighted as if uniformly",
        file: DIRECT,
        from: "scene.lights.sample(light, ctx, u_place, self.wl).map(|s| (s, chosen))",
        to: "scene.lights.sample(light, ctx, u_place, self.wl).map(|s| (s, 0.0 * chosen + 1.0 / scene.lights.ids().count() as f32))",
        tests: &[agreement(&["many_lamps", "points_and_spots"])],
    },
    Mutant {
        name: "area-as-solid-angle-lamp",
        mistake: "a lamp's density per area is used as one per solid angle",
        file: "crates/scene/src/lights/emitter/mod.rs",
        from: "let pdf = s.pdf.to_solid_angle(geometry(from, s.p, s.n)?);",
        to: "let pdf = geometry(from, s.p, s.n).map(|_| Pdf::new(s.pdf.value()))?;",
        tests: &[of(
            "steradian-scene",
            &["--test", "lights"],
            &["follow_their_density", "closed_forms", "density_of_its"],
        )],
    },
    Mutant {
        name: "area-as-solid-angle-walk",
        mistake: "a walk's density per solid angle is used as one per area",
        file: SUBPATH,
        from: "let per_area = density * n.0.dot(d).abs() / (distance_squared * distance_squared.sqrt());",
        to: "let per_area = density + 0.0 * n.0.dot(d).abs() / distance_squared;",
        tests: &[unit("steradian-integrators", &[]), agreement(&[])],
    },
    Mutant {
        name: "sky-density",
        mistake: "an equal-area sky's density per hemisphere instead of per sphere",
        file: "crates/scene/src/lights/infinite.rs",
        from: "SphericalMapping::EqualArea => 1.0 / (4.0 * PI),",
        to: "SphericalMapping::EqualArea => 1.0 / (2.0 * PI),",
        tests: &[of("steradian-scene", &["--test", "lights"], &["infinite", "density", "agree"])],
    },
    Mutant {
        name: "reflection-jacobian",
        mistake: "rough metal: density without the 1/4 of the reflection's Jacobian",
        file: "crates/scatter/src/bsdf/conductor.rs",
        from: "(self.fresnel(wo.dot(m)) * (half_d * visibility), Pdf::new(half_d / (co + so)))",
        to: "(self.fresnel(wo.dot(m)) * (half_d * visibility), Pdf::new(4.0 * half_d / (co + so)))",
        tests: &[of("steradian-scatter", &["--test", "laws"], &["conductor"])],
    },
    Mutant {
        name: "refraction-jacobian",
        mistake: "rough glass: density without the refraction's Jacobian",
        file: "crates/scatter/src/bsdf/dielectric.rs",
        from: "let jacobian = 4.0 * (wi.dot(m) * wo.dot(m)).abs() / (sum * sum).max(f32::MIN_POSITIVE);",
        to: "let jacobian = 4.0 * (wi.dot(m) * wo.dot(m)).abs() + 0.0 * sum;",
        tests: &[of("steradian-scatter", &["--test", "laws"], &["dielectric"])],
    },
    Mutant {
        name: "g1-for-g2",
        mistake: "facets: the weight of a sample has G1(wi) in place of G2/G1(wo)",
        file: "crates/scatter/src/microfacet.rs",
        from: "ci * (co + so) * self.visibility([co, so], [ci, si])",
        to: "2.0 * ci / (ci + si + 0.0 * (co + so))",
        tests: &[of("steradian-scatter", &["--test", "laws"], &["conductor"])],
    },
    Mutant {
        name: "alpha-for-alpha-squared",
        mistake: "GGX: α for α² in D",
        file: "crates/scatter/src/microfacet/ggx.rs",
        from: "1.0 / (PI * ax * ay * q * q)",
        to: "1.0 / (PI * (ax * ay).sqrt() * q * q)",
        tests: &[of("steradian-scatter", &["--test", "laws"], &["conductor"])],
    },
    Mutant {
        name: "camera-importance",
        mistake: "the camera's density with cos² for cos³",
        file: "crates/scene/src/cameras/importance.rs",
        from: "(film.area * cos * cos * cos)",
        to: "(film.area * cos * cos)",
        tests: &[of("steradian-scene", &["--test", "cameras"], &[]), agreement(&["large_lamp"])],
    },
    Mutant {
        name: "correlated-lobe",
        mistake: "one random number chooses the lobe and the facet",
        file: "crates/integrators/src/common/directions.rs",
        from: "return by_bsdf(bsdf, wo, u_lobe, sampler.next_2d(), mode);",
        to: "let u = sampler.next_2d(); return by_bsdf(bsdf, wo, if bsdf.has_choice() { u[1] } else { u_lobe }, u, mode);",
        tests: &[
            of("steradian-tests", &["--test", "global_light"], &["glass"]),
            of("steradian-tests", &["--test", "surfaces"], &["energy", "sheets"]),
        ],
    },
    Mutant {
        name: "ao-factor",
        mistake: "uniform ambient occlusion without its factor 2",
        file: "crates/integrators/src/ao.rs",
        from: "(w, 2.0 * w.cos_theta())",
        to: "(w, w.cos_theta())",
        tests: &[of("steradian-tests", &["--test", "occlusion"], &[])],
    },
    // ---- how estimates are joined ----
    Mutant {
        name: "no-weight",
        mistake: "light samples counted in full beside rays that find the lamp",
        file: DIRECT,
        from: "h.weight(all, rival) / pdf.value()",
        to: "{ let _ = (h, rival, all); 1.0 / pdf.value() }",
        tests: &[agreement(&["large_lamp"])],
    },
    Mutant {
        name: "swapped-weight",
        mistake: "rays that find a lamp get the light sample's weight",
        file: PATH,
        from: "h.weight(*pdf, light_pdf(from))",
        to: "h.weight(light_pdf(from), *pdf)",
        tests: &[agreement(&["large_lamp"])],
    },
    Mutant {
        name: "two-heuristics",
        mistake: "balance heuristic on one side, power heuristic on the other",
        file: DIRECT,
        from: "h.weight(all, rival) / pdf.value()",
        to: "{ let _ = h; Heuristic::Balance.weight(all, rival) / pdf.value() }",
        tests: &[agreement(&["large_lamp"])],
    },
    Mutant {
        name: "sky-without-pick",
        mistake: "a found sky is weighed as if every light sample went to the sky",
        file: DIRECT,
        from: "scene.lights.pdf(light, from, from.p, w, w) * chosen",
        to: "scene.lights.pdf(light, from, from.p, w, w) * (1.0 + 0.0 * chosen)",
        tests: &[agreement(&["sky_and_a_sun"])],
    },
    Mutant {
        name: "delta-light-found",
        mistake: "bdpt: weights as if rays could find point lights",
        file: "crates/integrators/src/bdpt/strategies.rs",
        from: "let end = LightEnd { emit, direct, is_hittable: !is_delta };",
        to: "let end = LightEnd { emit, direct, is_hittable: true };",
        tests: &[of("steradian-tests", &["--test", "direct_light"], &["delta_lights"])],
    },
    Mutant {
        name: "delta-connected",
        mistake: "bdpt: weights as if delta surfaces could be connected",
        file: "crates/integrators/src/bdpt/weight.rs",
        from: "_ => !links[s - 1].is_delta && !links[s].is_delta,",
        to: "_ => true,",
        tests: &[agreement(&["smooth_glass"])],
    },
    Mutant {
        name: "direct-as-emission",
        mistake: "bdpt: weights forget that next-event estimation draws the light anew",
        file: "crates/integrators/src/bdpt/weight.rs",
        from: "1 => end.direct,",
        to: "1 => end.emit,",
        tests: &[unit("steradian-integrators", &["bdpt"])],
    },
    Mutant {
        name: "no-cosine-in-weights",
        mistake: "bdpt: no cosine where a density per solid angle becomes one per area",
        file: SUBPATH,
        from: "let per_area = density * n.0.dot(d).abs() / (distance_squared * distance_squared.sqrt());",
        to: "let per_area = density * (1.0 + 0.0 * n.0.dot(d)) / distance_squared;",
        tests: &[unit("steradian-integrators", &["subpath"])],
    },
    Mutant {
        name: "splats-of-the-crop",
        mistake: "bdpt: splats divided by the film's pixels, though only the crop has light paths",
        file: BDPT,
        from: "let per_light_path = scene.camera.n_pixels() / scene.settings().sample_bounds().area() as f32;",
        to: "let per_light_path = 1.0;",
        tests: &[of("steradian-tests", &["--test", "strategies"], &[])],
    },
    Mutant {
        name: "mlt-both-in-full",
        mistake: "mlt: samples count in full what chains have their share of",
        file: MLT_BLOCK,
        from: "self.per_size.map_or(0.0, |k| 1.0 / (k * size + survival))",
        to: "self.per_size.map_or(0.0, |k| 1.0 / (0.0 * k * size + survival))",
        tests: &[agreement(&["large_lamp"])],
    },
    Mutant {
        name: "mlt-only-accepted",
        mistake: "mlt: both states of a step recorded in full",
        file: MLT_BLOCK,
        from: "record(&state, technique, 1.0 - acceptance);",
        to: "record(&state, technique, 1.0);",
        tests: &[agreement(&["large_lamp"])],
    },
    // ---- how it is added up ----
    Mutant {
        name: "unfiltered-splats",
        mistake: "splats without the pixel filter's weight",
        file: "crates/film/src/pass.rs",
        from: "let value = s.rgb.map(|v| Fixed::from_f32(w * v).unwrap_or_default());",
        to: "let value = s.rgb.map(|v| Fixed::from_f32(v + 0.0 * w).unwrap_or_default());",
        tests: &[of("steradian-film", &["--test", "values"], &[]), agreement(&["parallel_projection"])],
    },
    Mutant {
        name: "biased-variance",
        mistake: "the variance of the mean over n² in place of n (n − 1)",
        file: "crates/film/src/develop.rs",
        from: "let divisor = self.n * (self.n - 1.0)",
        to: "let divisor = self.n * self.n",
        tests: &[of("steradian-film", &["--test", "values"], &[])],
    },
];
