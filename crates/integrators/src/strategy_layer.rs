//! Names of the layers that `show=strategies` makes: for whoever writes them, and for whoever arranges them on a sheet.

/// The image that one strategy makes: `s` vertices of its paths come from the light, `t` from the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StrategyLayer {
    /// Vertices from the light.
    pub s: usize,
    /// Vertices from the eye.
    pub t: usize,
    /// Multiplied by the weights of multiple importance sampling? The weighted layers add up to the image.
    pub is_weighted: bool,
}

impl StrategyLayer {
    /// The layer's name, such as `s2t3.weighted`; its channels are `s2t3.weighted.R` and so on.
    #[must_use]
    pub fn name(&self) -> String {
        format!("s{}t{}.{}", self.s, self.t, if self.is_weighted { "weighted" } else { "unweighted" })
    }

    /// The layer that has this name.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        let (st, kind) = name.split_once('.')?;
        let (s, t) = st.strip_prefix('s')?.split_once('t')?;
        let is_weighted = match kind {
            "weighted" => true,
            "unweighted" => false,
            _ => return None,
        };
        Some(Self { s: s.parse().ok()?, t: t.parse().ok()?, is_weighted })
    }

    /// Scattering events of its paths.
    #[must_use]
    pub fn depth(&self) -> usize {
        (self.s + self.t).saturating_sub(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_read_back() {
        for is_weighted in [true, false] {
            let layer = StrategyLayer { s: 12, t: 3, is_weighted };
            assert_eq!((StrategyLayer::parse(&layer.name()), layer.depth()), (Some(layer), 13));
        }
        for other in ["variance.R", "s1t2", "s1t2.R", "st.weighted", "1t2.weighted"] {
            assert_eq!(StrategyLayer::parse(other), None, "{other}");
        }
    }
}
