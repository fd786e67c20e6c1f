//! What can be wrong with the input of a build.

/// Why a [`Blas`](crate::Blas) or [`Accel`](crate::Accel) could not be built.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A face names a vertex that is not there.
    #[error(
        "geometry {geometry}: primitive {primitive} uses vertex {index}, but there are only {len} vertices"
    )]
    IndexOutOfRange {
        /// Index of the geometry.
        geometry: u32,
        /// Index of the face.
        primitive: u32,
        /// The vertex index.
        index: u32,
        /// How many vertices there are.
        len: usize,
    },
    /// The two keys of a moving mesh differ in length.
    #[error("geometry {geometry}: {start} vertices at the first key, {end} at the second")]
    KeysDiffer {
        /// Index of the geometry.
        geometry: u32,
        /// Vertices at the first key.
        start: usize,
        /// Vertices at the second key.
        end: usize,
    },
    /// More primitives than 30 bits can number.
    #[error("{0} primitives in one structure; at most {max} fit", max = crate::layout::MAX_ITEMS)]
    TooManyPrimitives(usize),
    /// An instance names an object that is not there.
    #[error("instance {instance} uses object {object}, but there are only {len} objects")]
    NoSuchObject {
        /// Index of the instance.
        instance: usize,
        /// The object it wants.
        object: u32,
        /// How many objects there are.
        len: usize,
    },
}
