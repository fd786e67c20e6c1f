//! Cells, schedule, stop rules, checkpoints, events.
