//! Meshes made by formulas, for demo scenes, tests and benches.
