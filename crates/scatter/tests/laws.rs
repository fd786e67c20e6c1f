//! Every kind of surface and of phase function obeys the laws of its family.

use spectrum::Spectrum;
use steradian_scatter::microfacet::Facets;
use steradian_scatter::{
    Bsdf, BsdfKind, Coat, CoatProfile, CoatedConductor, CoatedDiffuse, Conductor, Dielectric, Diffuse,
    DiffuseTransmission, HenyeyGreenstein, Isotropic, OrenNayar, Plastic, Rayleigh, ThinDielectric,
    TintedDielectric,
};
use testkit::{bsdf_laws, phase_laws};

const RED: Spectrum = Spectrum::from_rgb([0.8, 0.2, 0.1]);

/// Copper at about 630, 530 and 460 nm [Johnson1972].
fn copper(alpha: [f32; 2]) -> Conductor {
    Conductor::new(Spectrum::from_rgb([0.22, 1.1, 1.15]), Spectrum::from_rgb([3.5, 2.57, 2.45]), alpha)
}

fn copper_of(facets: Facets) -> Conductor {
    Conductor::new(Spectrum::from_rgb([0.22, 1.1, 1.15]), Spectrum::from_rgb([3.5, 2.57, 2.45]), facets)
}

fn coat(alpha: [f32; 2]) -> Coat {
    Coat { alpha, ..Coat::default() }
}

fn milky(alpha: [f32; 2]) -> Coat {
    Coat { albedo: Spectrum::from_rgb([0.9, 0.7, 0.5]), thickness: 0.5, g: 0.3, max_depth: 40, ..coat(alpha) }
}

fn closed(alpha: f32) -> CoatedDiffuse {
    CoatedDiffuse::new(RED, &coat([alpha; 2]), Some(CoatProfile::new(1.5, alpha, 0.01)))
}

fn plastic(facets: Facets, nonlinear: bool) -> Plastic {
    Plastic::new(RED, 1.5, facets, CoatProfile::of(1.5, facets, 0.0), nonlinear)
}

bsdf_laws! {
    diffuse: Diffuse::new(RED);
    diffuse_transmission: DiffuseTransmission::new(RED, Spectrum::from_rgb([0.1, 0.5, 0.3]));
    mirror: copper([0.0; 2]);
    conductor: copper([0.3; 2]);
    conductor_shiny: copper([0.08; 2]);
    conductor_brushed: copper([0.1, 0.5]);
    conductor_beckmann: copper_of(Facets::beckmann(0.3, 0.3));
    conductor_beckmann_brushed: copper_of(Facets::beckmann(0.1, 0.5));
    dielectric_beckmann: Dielectric::new(1.5, Facets::beckmann(0.3, 0.3));
    dielectric_smooth: Dielectric::new(1.5, [0.0; 2]);
    dielectric: Dielectric::new(1.5, [0.3; 2]);
    dielectric_brushed: Dielectric::new(1.33, [0.6, 0.15]);
    dielectric_bubble: Dielectric::new(1.0 / 1.5, [0.25; 2]);
    dielectric_absent: Dielectric::new(1.0, [0.3; 2]);
    pane: ThinDielectric::new(1.5);
    coated_diffuse_smooth: closed(0.0);
    coated_diffuse: closed(0.25);
    coated_diffuse_walk: CoatedDiffuse::new(RED, &coat([0.3; 2]), None);
    coated_diffuse_brushed: CoatedDiffuse::new(RED, &coat([0.2, 0.5]), None);
    coated_diffuse_milky: CoatedDiffuse::new(RED, &milky([0.0; 2]), None);
    coated_conductor_mirror: CoatedConductor::new(copper([0.0; 2]), &coat([0.0; 2]));
    coated_conductor_lacquered: CoatedConductor::new(copper([0.3; 2]), &coat([0.0; 2]));
    coated_conductor: CoatedConductor::new(copper([0.25; 2]), &coat([0.3; 2]));
    coated_conductor_milky: CoatedConductor::new(copper([0.3; 2]), &milky([0.25; 2]));
    oren_nayar: OrenNayar::new(RED, 0.5);
    plastic_smooth: plastic(Facets::SMOOTH, true);
    plastic: plastic(Facets::beckmann(0.25, 0.25), false).tinted(RED);
    plastic_regularized: plastic(Facets::SMOOTH, true).regularized();
    tinted_glass: TintedDielectric::glass(Dielectric::new(1.5, [0.3; 2]), RED, RED * 0.5);
    tinted_pane: TintedDielectric::pane(ThinDielectric::new(1.5), RED, RED * 0.5);
    any: Bsdf::from(Diffuse::new(RED));
    regularized_glass: Bsdf::from(Dielectric::new(1.5, [0.02; 2])).regularized();
    regularized_coat: Bsdf::from(closed(0.04)).regularized();
}

phase_laws! {
    isotropic: Isotropic;
    forward: HenyeyGreenstein::new(0.85);
    backward: HenyeyGreenstein::new(-0.4);
    rayleigh: Rayleigh;
}
