//! Index newtypes of the compiled scene.

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(transparent)]
        pub struct $name(pub u32);
        impl $name {
            /// As an index into its vector.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

ids! {
    /// A light: one infinite light, one delta light, or one emitting primitive (a triangle of an emitting mesh).
    LightId,
    /// A material.
    MaterialId,
    /// A medium.
    MediumId,
    /// A compiled shape: one mesh or one analytic primitive.
    ShapeId,
    /// A compiled texture.
    TextureId,
}
