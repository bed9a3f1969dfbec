//! JSON values that know where they are, so that an error can say so.

use crate::error::{ErrorKind, SceneError};
use glam::Vec3;
use serde_json::Value;

/// A value with its path, such as `meshes[3].primitives[0]`.
#[derive(Clone, Debug)]
pub(super) struct Node<'a> {
    value: &'a Value,
    pub path: String,
}

impl<'a> Node<'a> {
    pub fn root(value: &'a Value) -> Self {
        Self { value, path: String::new() }
    }

    pub fn error(&self, message: impl std::fmt::Display) -> SceneError {
        self.error_of(ErrorKind::Value, message)
    }

    pub fn error_of(&self, kind: ErrorKind, message: impl std::fmt::Display) -> SceneError {
        let path = if self.path.is_empty() { "the file" } else { &self.path };
        SceneError::new(kind, format!("{path}: {message}"))
    }

    /// A member that is there and not null.
    pub fn get(&self, key: &str) -> Option<Node<'a>> {
        let value = self.value.get(key).filter(|value| !value.is_null())?;
        let path = if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) };
        Some(Node { value, path })
    }

    pub fn require(&self, key: &str) -> Result<Node<'a>, SceneError> {
        self.get(key).ok_or_else(|| self.error(format!("`{key}` is missing")))
    }

    /// An extension of this object.
    pub fn extension(&self, name: &str) -> Option<Node<'a>> {
        self.get("extensions")?.get(name)
    }

    /// The items of a list; none where it is missing.
    pub fn list(&self, key: &str) -> Result<Vec<Node<'a>>, SceneError> {
        let Some(list) = self.get(key) else { return Ok(Vec::new()) };
        let Value::Array(items) = list.value else { return Err(list.error("a list belongs here")) };
        let item = |(i, value)| Node { value, path: format!("{}[{i}]", list.path) };
        Ok(items.iter().enumerate().map(item).collect())
    }

    /// The item of a list of the file that the number `key` names.
    pub fn named(
        &self,
        key: &str,
        list: &Node<'a>,
        plural: &str,
    ) -> Result<Option<(usize, Node<'a>)>, SceneError> {
        let Some(index) = self.whole(key)? else { return Ok(None) };
        let count = list.get(plural).and_then(|l| l.value.as_array()).map_or(0, Vec::len);
        match list.item(plural, index) {
            Some(item) => Ok(Some((index, item))),
            None => Err(self.error(format!("`{key}` is {index}, but there are {count} {plural}"))),
        }
    }

    pub fn item(&self, key: &str, index: usize) -> Option<Node<'a>> {
        let list = self.get(key)?;
        let value = list.value.as_array()?.get(index)?;
        Some(Node { value, path: format!("{}[{index}]", list.path) })
    }

    /// A number that is not negative and whole.
    pub fn as_whole(&self) -> Result<usize, SceneError> {
        let whole = self.value.as_u64().or_else(|| {
            let v = self.value.as_f64().filter(|v| v.fract() == 0.0 && (0.0..9e15).contains(v))?;
            Some(v as u64)
        });
        whole.and_then(|v| usize::try_from(v).ok()).ok_or_else(|| self.error("a whole number belongs here"))
    }

    pub fn whole(&self, key: &str) -> Result<Option<usize>, SceneError> {
        self.get(key).map(|node| node.as_whole()).transpose()
    }

    pub fn as_number(&self) -> Result<f64, SceneError> {
        let value = self.value.as_f64().filter(|v| (*v as f32).is_finite());
        value.ok_or_else(|| self.error("a number belongs here"))
    }

    pub fn number(&self, key: &str, default: f32) -> Result<f32, SceneError> {
        self.get(key).map_or(Ok(default), |node| node.as_number().map(|v| v as f32))
    }

    pub fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, SceneError> {
        let Some(list) = self.get(key) else { return Ok(None) };
        let items = self.list(key)?;
        if items.len() != N {
            return Err(list.error(format!("a list of {N} numbers belongs here")));
        }
        let mut all = [0.0; N];
        for (value, item) in all.iter_mut().zip(items) {
            *value = item.as_number()?;
        }
        Ok(Some(all))
    }

    pub fn color(&self, key: &str, default: Vec3) -> Result<Vec3, SceneError> {
        let color = self.numbers::<3>(key)?.map(|c| Vec3::from(c.map(|v| v as f32)).max(Vec3::ZERO));
        Ok(color.unwrap_or(default))
    }

    pub fn as_str(&self) -> Result<&'a str, SceneError> {
        self.value.as_str().ok_or_else(|| self.error("a text belongs here"))
    }

    pub fn text(&self, key: &str) -> Result<Option<&'a str>, SceneError> {
        self.get(key).map(|node| node.as_str()).transpose()
    }

    pub fn flag(&self, key: &str) -> Result<bool, SceneError> {
        let Some(node) = self.get(key) else { return Ok(false) };
        node.value.as_bool().ok_or_else(|| node.error("true or false belongs here"))
    }

    /// The name, or one made from the place.
    pub fn name(&self) -> String {
        let name = self.value.get("name").and_then(Value::as_str).unwrap_or_default();
        if name.is_empty() { self.path.clone() } else { name.chars().take(200).collect() }
    }
}
