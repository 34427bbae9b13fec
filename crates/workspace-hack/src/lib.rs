//! Empty: its manifest gives each dependency of the workspace one set of features.
