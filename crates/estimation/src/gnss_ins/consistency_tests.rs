//! Consistency over seeds.
