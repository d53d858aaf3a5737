//! Paths of modules and nodes, such as `memory/population`: which lie inside which.

/// Returns whether `path` is that of the module at `module`, or of something inside it.
pub(crate) fn is_within(path: &str, module: &str) -> bool {
    path.strip_prefix(module).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// Returns whether `path` is that of something inside the module at `module`.
pub(crate) fn is_inside(path: &str, module: &str) -> bool {
    path != module && is_within(path, module)
}
