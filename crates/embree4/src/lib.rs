//! A sound, safe wrapper around Intel Embree 4.
