//! Densities with their measures, multiple importance sampling, random numbers, samplers, warps and distributions.
