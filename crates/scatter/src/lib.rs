//! BSDFs, microfacet distributions, Fresnel and phase functions: pure, in the local frame.
