//! The service as an editor sees it.

mod actions;
mod completion;
mod fixture;
mod hover;
mod navigate;
mod picture;
mod rename;
