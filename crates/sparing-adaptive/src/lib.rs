//! Where samples go: statistics of the pixels so far, policies that decide who goes on, the loop that drives them.
//!
//! A render proceeds in layers. Every pixel gets the minimum; then, at each barrier, a [`Policy`](policy::Policy) sees the
//! statistics of all pixels ([`View`](view::View)) and says which of them double their samples. Nothing but the film and its
//! [`Ledger`](ledger::Ledger) passes from layer to layer, so the picture does not depend on threads or tile order.
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`view`] | what is known of every pixel at a barrier |
//! | [`pooling`] | neighbourhoods of 3 by 3 pixels |
//! | [`goal`] | tolerance, average or fixed threshold; what threshold reaches it |
//! | [`policy`] | one file a policy |
//! | [`features`] | what a machine knows of a pixel, by name |
//! | [`paper_features`] | the eight features of 2015 |
//! | [`machine`] | a support vector machine with its features and scaling, from its two files |
//! | [`layers`] | the loop |
//! | [`ledger`], [`redistribute`] | why choosing pixels by their samples takes little light away |
//! | [`budget`] | who goes on if the time does not suffice |
//! | [`training`] | rows from rendered scenes, labels, fits |
//! | [`study`] | how policies compare at equal error |

mod audit;
pub mod budget;
pub mod features;
pub mod goal;
pub mod layers;
pub mod ledger;
pub mod machine;
pub mod paper_features;
pub mod policy;
pub mod pooling;
pub mod redistribute;
pub mod state;
mod statistics;
pub mod study;
pub mod training;
pub mod view;
