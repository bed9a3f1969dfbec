//! Statistical tests for samplers and renders. For tests only: functions panic with a message on failure.

pub mod chi_square;
pub mod pictures;
pub mod special;
pub mod svm_data;
pub mod t_test;
