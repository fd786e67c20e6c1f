//! Every kind of surface and of phase function obeys the laws of its family.

use std::sync::Arc;

use spectrum::Spectrum;
use steradian_scatter::microfacet::Facets;
use steradian_scatter::{
    BlendedPhase, Bsdf, BsdfKind, Coat, CoatProfile, CoatedConductor, CoatedDiffuse, CompensatedConductor,
    Conductor, Dielectric, Diffuse, DiffuseTransmission, Hair, HenyeyGreenstein, Isotropic, Measured,
    MeasuredTable, MetallicRoughness, MetallicRoughnessParameters, OrenNayar, Plastic, Principled,
    PrincipledParameters, PrincipledThin, PurePhase, Rayleigh, SoftBorder, ThinDielectric, ThinParameters,
    TintedDielectric, TransportMode,
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

fn paint() -> PrincipledParameters {
    PrincipledParameters {
        base: RED * 0.8,
        hue: RED * 2.0,
        metallic: 0.3,
        roughness: 0.5,
        facets: Principled::facets(0.5, 0.6),
        eta: 1.5,
        spec_tint: 0.3,
        spec_trans: 0.0,
        sheen: 0.0,
        sheen_tint: 0.5,
        flatness: 0.0,
        clearcoat: 0.8,
        clearcoat_gloss: 0.1,
        clearcoat_of_facets: false,
    }
}

fn gltf() -> MetallicRoughnessParameters {
    MetallicRoughnessParameters {
        base: RED,
        metallic: 0.0,
        facets: MetallicRoughness::facets(0.5, 0.0),
        eta: 1.5,
        specular: 1.0,
        specular_color: Spectrum::ONE,
        sheen: Spectrum::ZERO,
        sheen_roughness: 0.0,
        clearcoat: 0.0,
        clearcoat_roughness: 0.0,
        transmission: 0.0,
        diffuse_transmission: (0.0, Spectrum::ONE),
        thin: true,
    }
}

fn sheet() -> ThinParameters {
    ThinParameters {
        base: RED * 0.8,
        hue: RED * 2.0,
        roughness: 0.6,
        facets: Principled::facets(0.6, 0.0),
        facets_through: Principled::facets(PrincipledThin::roughness_through(0.6, 1.4), 0.0),
        eta: 1.4,
        spec_tint: 0.2,
        spec_trans: 0.5,
        sheen: 0.1,
        sheen_tint: 0.5,
        flatness: 0.3,
        diff_trans: 0.4,
    }
}

/// A conductor of GGX facets, as if it had been measured.
fn measured(alpha: [f32; 2]) -> Measured {
    let metal = copper(alpha);
    let parts = testkit::measured::tabulate(alpha, true, |wo, wi| {
        (metal.eval(wo, wi, TransportMode::Radiance) * wi.abs_cos_theta()).rgb()
    });
    let table = parts.and_then(MeasuredTable::new).expect("its parts fit");
    Measured::new(Arc::new(table), [0.0, 1.0, 2.0, 0.5])
}

/// Droplets, molecules, and dust that throws light back.
fn haze() -> BlendedPhase {
    let [forward, backward] = [0.8, -0.3].map(|g| PurePhase::HenyeyGreenstein(HenyeyGreenstein::new(g)));
    let (rayleigh, none) = (PurePhase::Rayleigh(Rayleigh), PurePhase::Isotropic(Isotropic));
    BlendedPhase::new(&[(1.5, forward), (0.75, rayleigh), (0.0, none), (0.75, backward)]).expect("four parts")
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
    border_smooth: SoftBorder::new(1.33, [0.0; 2]);
    border: SoftBorder::new(1.5, [0.3; 2]);
    border_matt: SoftBorder::new(1.5, [0.9; 2]);
    border_absent: SoftBorder::new(1.0, [0.3; 2]);
    border_bubble: SoftBorder::new(0.8, [0.2; 2]);
    border_over_profile: SoftBorder::new(1.33, [0.3; 2]).over_profile();
    border_emerging: SoftBorder::new(1.33, [0.3; 2]).emerging().0;
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
    principled: Principled::new(paint());
    principled_disney: Principled::new(PrincipledParameters { clearcoat_of_facets: true, ..paint() });
    principled_glass: Principled::new(PrincipledParameters { spec_trans: 0.8, metallic: 0.1, ..paint() });
    principled_cloth: Principled::new(PrincipledParameters { sheen: 0.2, flatness: 0.6, clearcoat: 0.0, ..paint() });
    principled_thin: PrincipledThin::new(sheet());
    principled_leaf: PrincipledThin::new(ThinParameters { spec_trans: 0.0, ..sheet() });
    gltf_white: MetallicRoughness::new(&MetallicRoughnessParameters { base: Spectrum::ONE, ..gltf() });
    gltf_layers: MetallicRoughness::new(&MetallicRoughnessParameters {
        metallic: 0.3,
        sheen: RED,
        sheen_roughness: 0.4,
        clearcoat: 0.8,
        clearcoat_roughness: 0.2,
        facets: MetallicRoughness::facets(0.4, 0.6),
        ..gltf()
    });
    gltf_sheet: MetallicRoughness::new(&MetallicRoughnessParameters {
        transmission: 0.6,
        diffuse_transmission: (0.4, RED),
        clearcoat: 0.5,
        clearcoat_roughness: 0.4,
        sheen: RED * 0.5,
        sheen_roughness: 0.8,
        ..gltf()
    });
    gltf_glass: MetallicRoughness::new(&MetallicRoughnessParameters { transmission: 0.9, thin: false, ..gltf() });
    conductor_compensated: CompensatedConductor::new(copper([0.5; 2]));
    conductor_compensated_beckmann: CompensatedConductor::new(copper_of(Facets::beckmann(0.8, 0.8)));
    hair: Hair::new(Spectrum::from_rgb([0.1, 0.3, 0.8]), 0.3, 1.55, [0.3, 0.3], 0.035);
    hair_smooth: Hair::new(Spectrum::from_rgb([0.0, 0.3, 1.8]), -0.8, 1.55, [0.2, 0.25], 0.05);
    hair_rough: Hair::new(Spectrum::ZERO, 0.0, 1.3, [0.9, 0.8], 0.0);
    measured: measured([0.5; 2]);
    measured_brushed: measured([0.3, 0.6]);
    any: Bsdf::from(Diffuse::new(RED));
    regularized_glass: Bsdf::from(Dielectric::new(1.5, [0.02; 2])).regularized();
    regularized_coat: Bsdf::from(closed(0.04)).regularized();
}

phase_laws! {
    isotropic: Isotropic;
    forward: HenyeyGreenstein::new(0.85);
    backward: HenyeyGreenstein::new(-0.4);
    rayleigh: Rayleigh;
    blended: haze();
}

/// A kind without laws is no kind: every member of the closed set stands on a line above, by its constructor.
#[test]
fn every_kind_has_its_laws() {
    let text = include_str!("laws.rs");
    let laws = text.split("bsdf_laws! {").nth(1).unwrap();
    let helpers = text.split("bsdf_laws! {").next().unwrap();
    for name in Bsdf::NAMES {
        // In a line of its own, or by a helper that makes it.
        let made = format!("-> {name} {{");
        let by_helper = helpers.split("fn ").skip(1).filter(|f| f.contains(&made)).any(|f| {
            let helper = f.split('(').next().unwrap_or_default();
            laws.contains(&format!(": {helper}("))
        });
        assert!(laws.contains(&format!(": {name}::")) || by_helper, "{name} has no laws");
    }
}
