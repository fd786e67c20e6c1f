//! Image buffers, tone mapping and codecs.
