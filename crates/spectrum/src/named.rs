//! Spectra with a name: standard illuminants, metals, glasses.
//!
//! | names                                   | data                                               |
//! |-----------------------------------------|----------------------------------------------------|
//! | `stdillum-A`, `-C`, `-D50` …, `-F1` …   | [CIE15] tables: `data/illuminants.txt`              |
//! | `illum-acesD60`                         | CIE daylight of 6000 K                             |
//! | `metal-Ag-eta`, `metal-Ag-k`, …         | papers named one by one in `data/conductors.txt`   |
//! | `glass-BK7`, `glass-SF11`, …            | Schott's Sellmeier coefficients: `data/glasses.txt` |
//!
//! Names are pbrt-v4's, and `metal-X-…` is there for more metals. Departs from pbrt-v4: its metals are of other (older)
//! tables; the reflectance of ours differs by about 0.01 (gold, chromium) or less in the mean over the visible range
//! (iridium 0.04, tantalum 0.05). Left out: cameras' sensor curves.

use std::sync::Arc;

use crate::curve::{Outside, PiecewiseLinear};
use crate::{SpectralCurve, cie};

const ILLUMINANTS: &str = include_str!("../data/illuminants.txt");
const CONDUCTORS: &str = include_str!("../data/conductors.txt");
const GLASSES: &str = include_str!("../data/glasses.txt");

/// pbrt's names of glasses, and the maker's.
const GLASS_NAMES: [(&str, &str); 15] = [
    ("glass-BK7", "N-BK7"),
    ("glass-BAF10", "N-BAF10"),
    ("glass-FK51A", "N-FK51A"),
    ("glass-LASF9", "N-LASF9"),
    ("glass-F5", "SF5"),
    ("glass-F10", "SF10"),
    ("glass-F11", "SF11"),
    ("glass-SF5", "SF5"),
    ("glass-SF6", "SF6"),
    ("glass-SF10", "SF10"),
    ("glass-SF11", "SF11"),
    ("glass-F2", "F2"),
    ("glass-BAK4", "N-BAK4"),
    ("glass-K5", "N-K5"),
    ("glass-fused-silica", "fused-silica"),
];

/// Every name, for messages that say what there is.
#[must_use]
pub fn names() -> Vec<String> {
    let mut names = vec!["stdillum-E".to_owned()];
    names.extend(headers(ILLUMINANTS).map(str::to_owned).filter(|n| !n.starts_with("daylight-")));
    for metal in headers(CONDUCTORS) {
        names.push(format!("metal-{metal}-eta"));
        names.push(format!("metal-{metal}-k"));
    }
    names.extend(GLASS_NAMES.iter().map(|(name, _)| (*name).to_owned()));
    names
}

/// The spectrum of that name.
pub(crate) fn find(name: &str) -> Option<SpectralCurve> {
    if name == "stdillum-E" {
        return Some(SpectralCurve::Constant(1.0));
    }
    piecewise(name).map(|p| SpectralCurve::Piecewise(Arc::new(p)))
}

/// [`find`] without the curve around it. Illuminants have the luminance of a constant spectrum of one.
pub(crate) fn piecewise(name: &str) -> Option<PiecewiseLinear> {
    if let Some(metal) = name.strip_prefix("metal-") {
        return metal
            .strip_suffix("-eta")
            .map(|m| (m, 1))
            .or_else(|| metal.strip_suffix("-k").map(|m| (m, 2)))
            .and_then(|(m, column)| conductor(m, column));
    }
    if let Some((_, glass)) = GLASS_NAMES.iter().find(|(n, _)| *n == name) {
        return sellmeier(glass);
    }
    if !name.starts_with("stdillum-") && !name.starts_with("illum-") {
        return None;
    }
    let raw = illuminant(name)?;
    let norm = cie::y_integral() / cie::integrate(|l| raw.eval64(l))[1];
    Some(raw.scaled(norm))
}

/// A column of the daylight series or an illuminant, as tabulated.
pub(crate) fn illuminant(name: &str) -> Option<PiecewiseLinear> {
    let (header, numbers) = block(ILLUMINANTS, name)?;
    let first: f64 = header.split_whitespace().nth(1)?.parse().ok()?;
    let points = numbers.iter().enumerate().map(|(i, v)| (first + 5.0 * i as f64, *v));
    PiecewiseLinear::new(points, Outside::Zero).ok()
}

fn conductor(metal: &str, column: usize) -> Option<PiecewiseLinear> {
    let (_, numbers) = block(CONDUCTORS, metal)?;
    PiecewiseLinear::new(numbers.chunks_exact(3).map(|c| (c[0], c[column])), Outside::Extend).ok()
}

/// n² = 1 + Σ Bᵢ λ² / (λ² − Cᵢ), λ in µm, tabulated every 5 nm (linear between: 10⁻⁵ off at most).
fn sellmeier(glass: &str) -> Option<PiecewiseLinear> {
    let line = GLASSES.lines().find(|l| l.split_whitespace().next() == Some(glass))?;
    let c: Vec<f64> = line.split_whitespace().skip(1).filter_map(|w| w.parse().ok()).collect();
    let index = |lambda_nm: f64| {
        let l2 = lambda_nm * lambda_nm * 1e-6;
        (1.0 + c.chunks_exact(2).map(|t| t[0] * l2 / (l2 - t[1])).sum::<f64>()).sqrt()
    };
    let grid = (0..=94).map(|i| 360.0 + 5.0 * f64::from(i));
    PiecewiseLinear::new(grid.map(|l| (l, index(l))), Outside::Extend).ok()
}

/// The first word of each block's head line.
fn headers(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|l| l.strip_prefix("= ")).filter_map(|h| h.split_whitespace().next())
}

/// The head line (without its mark) and the numbers of the block whose first word is `name`.
fn block<'a>(text: &'a str, name: &str) -> Option<(&'a str, Vec<f64>)> {
    let mut lines = text.lines();
    let header = lines
        .by_ref()
        .filter_map(|l| l.strip_prefix("= "))
        .find(|h| h.split_whitespace().next() == Some(name))?;
    let numbers = lines
        .take_while(|l| !l.starts_with('='))
        .flat_map(str::split_whitespace)
        .filter_map(|w| w.parse().ok())
        .collect();
    Some((header, numbers))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn xy(name: &str) -> [f64; 2] {
        let curve = piecewise(name).unwrap();
        let [x, y, z] = cie::integrate(|l| curve.eval64(l));
        [x / (x + y + z), y / (x + y + z)]
    }

    #[test]
    fn every_name_is_found_and_every_number_of_the_files_was_read() {
        for name in names() {
            assert!(find(&name).is_some(), "{name}");
        }
        for text in [ILLUMINANTS, CONDUCTORS, GLASSES] {
            for line in text.lines().filter(|l| !l.starts_with(['#', '='])) {
                let bad = line
                    .split_whitespace()
                    .skip(usize::from(text == GLASSES))
                    .find(|w| w.parse::<f64>().is_err());
                assert_eq!(bad, None, "{line}");
            }
        }
        for unknown in ["", "metal-Xx-eta", "metal-Ag", "glass-XY", "stdillum-Z", "daylight-S0"] {
            assert!(find(unknown).is_none(), "{unknown}");
        }
    }

    #[test]
    fn standard_illuminants_have_their_published_chromaticities() {
        let known = [
            ("stdillum-D65", [0.312_72, 0.329_03]),
            ("stdillum-A", [0.447_57, 0.407_44]),
            ("stdillum-D50", [0.3457, 0.3585]),
        ];
        for (name, [x, y]) in known {
            let got = xy(name);
            assert!((got[0] - x).abs() < 1e-4 && (got[1] - y).abs() < 1e-4, "{name} {got:?}");
        }
        // Those of the lamps with lines were published from sums in steps of 5 nm.
        for (name, [x, y]) in [("stdillum-F2", [0.3721, 0.3751]), ("stdillum-F11", [0.3805, 0.3769])] {
            let curve = piecewise(name).unwrap();
            let at_5 = |l: f64| if l % 5.0 == 0.0 { curve.eval64(l) } else { 0.0 };
            let [a, b, c] = cie::integrate(at_5);
            let s = a + b + c;
            assert!((a / s - x).abs() < 1e-4 && (b / s - y).abs() < 1e-4, "{name} {} {}", a / s, b / s);
        }
        let d = xy("illum-acesD60");
        assert!((d[0] - 0.32168).abs() < 2e-4 && (d[1] - 0.33767).abs() < 2e-4, "{d:?}");
    }

    #[test]
    fn glasses_have_their_catalogue_indices() {
        // n_d at 587.5618 nm, from the makers' data sheets.
        for (name, n) in
            [("glass-BK7", 1.51680), ("glass-SF11", 1.78472), ("glass-SF10", 1.72825), ("glass-F2", 1.62004)]
        {
            let got = piecewise(name).unwrap().eval64(587.5618);
            assert!((got - n).abs() < 2e-5, "{name} {got}");
        }
    }

    #[test]
    fn metals_are_bright_and_have_their_hue() {
        let f0 = |metal: &str, l: f64| {
            let n = piecewise(&format!("metal-{metal}-eta")).unwrap().eval64(l);
            let k = piecewise(&format!("metal-{metal}-k")).unwrap().eval64(l);
            ((n - 1.0) * (n - 1.0) + k * k) / ((n + 1.0) * (n + 1.0) + k * k)
        };
        assert!(f0("Ag", 550.0) > 0.93 && f0("Al", 550.0) > 0.89);
        assert!(f0("Au", 650.0) > 0.9 && f0("Au", 450.0) < 0.5);
        assert!(f0("Cu", 650.0) > 0.9 && f0("Cu", 450.0) < 0.65);
        assert!(f0("CuZn", 650.0) > f0("CuZn", 450.0) + 0.2);
    }
}
