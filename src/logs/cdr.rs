//! Messages of ROS: schemas in the text of message definitions, and the bytes that they describe. Also messages in JSON.

use std::borrow::Cow;
use std::collections::HashMap;

/// A value in a message. Flags are numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value<'a> {
    /// Nothing that is used: null, or a long list of plain numbers.
    Missing,
    Number(f64),
    Text(Cow<'a, str>),
    List(Vec<Value<'a>>),
    Record(Vec<(&'a str, Value<'a>)>),
}

impl<'a> Value<'a> {
    /// Returns a field of a record.
    pub fn get(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Record(fields) => fields.iter().find(|(own, _)| *own == name).map(|(_, v)| v),
            _ => None,
        }
    }

    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(*value),
            _ => None,
        }
    }

    /// Returns a text; a number is one, too.
    pub fn text(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::Text(text) => Some(Cow::Borrowed(text)),
            Self::Number(value) => Some(Cow::Owned(value.to_string())),
            _ => None,
        }
    }

    pub fn list(&self) -> &[Self] {
        match self {
            Self::List(list) => list,
            _ => &[],
        }
    }

    /// Returns a message in JSON.
    pub fn of_json(value: &'a serde_json::Value) -> Self {
        match value {
            serde_json::Value::Null => Self::Missing,
            serde_json::Value::Bool(flag) => Self::Number(f64::from(u8::from(*flag))),
            serde_json::Value::Number(number) => {
                number.as_f64().map_or(Self::Missing, Self::Number)
            }
            serde_json::Value::String(text) => Self::Text(Cow::Borrowed(text)),
            serde_json::Value::Array(list) => Self::List(list.iter().map(Self::of_json).collect()),
            serde_json::Value::Object(fields) => {
                let fields = fields.iter().map(|(name, v)| (name.as_str(), Self::of_json(v)));
                Self::Record(fields.collect())
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Plain {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

impl Plain {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "bool" | "uint8" | "byte" | "char" | "octet" => Self::Unsigned(1),
            "int8" => Self::Signed(1),
            "int16" => Self::Signed(2),
            "uint16" => Self::Unsigned(2),
            "int32" => Self::Signed(4),
            "uint32" => Self::Unsigned(4),
            "int64" => Self::Signed(8),
            "uint64" => Self::Unsigned(8),
            "float32" => Self::Float(4),
            "float64" => Self::Float(8),
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) | Self::Float(size) => size,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Type {
    Plain(Plain),
    Text,
    /// Text of wide characters, which is not read.
    Wide,
    /// A record, by its index in the schema.
    Record(usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Count {
    One,
    Fixed(usize),
    Any,
}

#[derive(Debug)]
struct Field {
    name: String,
    of: Type,
    count: Count,
}

/// The records of a message, the message itself first.
#[derive(Debug)]
pub(crate) struct Schema(Vec<Vec<Field>>);

/// Greatest number of records and of fields in a schema.
const MOST_FIELDS: usize = 10_000;
/// Greatest depth of records in records.
const DEEPEST: usize = 32;
/// Greatest number of values and fields in a message, and how many each of its bytes can explain.
const MOST_VALUES: usize = 4_000_000;
const VALUES_OF_A_BYTE: usize = 16;
/// A list of more plain numbers is not used.
const LONGEST: usize = 4_096;

/// Returns a type's name as `package/Type`.
fn short(name: &str) -> String {
    name.replace("/msg/", "/").replace("::msg::", "/").replace("::", "/")
}

impl Schema {
    /// Reads the definition of the type `name` and, behind lines of `=`, of those that it uses.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut texts: HashMap<String, Vec<&str>> = HashMap::new();
        let mut own = short(name);
        let first = own.clone();
        let mut lines: Vec<&str> = Vec::new();
        let mut begun = false;
        for line in text.lines() {
            let line = line.trim();
            if line.len() >= 3 && line.bytes().all(|b| b == b'=') {
                texts.entry(own.clone()).or_insert_with(|| std::mem::take(&mut lines));
                lines.clear();
                begun = true;
            } else if let Some(next) = line.strip_prefix("MSG:").filter(|_| begun) {
                (own, begun) = (short(next.trim()), false);
            } else {
                lines.push(line);
            }
        }
        texts.entry(own).or_insert(lines);
        let mut names: Vec<String> = vec![first];
        let (mut records, mut fields) = (Vec::new(), 0);
        while let Some(name) = names.get(records.len()).cloned() {
            let builtin = match name.rsplit('/').next() {
                Some("Time" | "Duration") => Some(vec!["int32 sec", "uint32 nanosec"]),
                Some("time") => Some(vec!["uint32 sec", "uint32 nanosec"]),
                Some("duration") => Some(vec!["int32 sec", "int32 nanosec"]),
                _ => None,
            };
            let Some(lines) = texts.get(&name).or(builtin.as_ref()) else {
                return Err(format!("its schema does not define `{name}`"));
            };
            let package = name.rsplit_once('/').map_or("", |(package, _)| package);
            let record =
                lines.iter().filter_map(|line| field(line, package, &mut names).transpose());
            let record = record.collect::<Result<Vec<Field>, String>>()?;
            fields += record.len() + 1;
            if fields.max(names.len()) > MOST_FIELDS {
                return Err("its schema has more than 10,000 fields".into());
            }
            records.push(record);
        }
        Ok(Self(records))
    }
}

/// Reads a line of a definition; `None` if it holds no field. New types are added to `names`.
fn field(line: &str, package: &str, names: &mut Vec<String>) -> Result<Option<Field>, String> {
    let line = line.split('#').next().unwrap_or_default().trim();
    if line.is_empty() {
        return Ok(None);
    }
    let bad = || format!("its schema has the line `{}`", line.chars().take(60).collect::<String>());
    let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(bad)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let (name, behind) = rest.split_at(end);
    // A constant has a value, and is not in the message.
    if behind.trim_start().starts_with('=') {
        return Ok(None);
    }
    if name.is_empty() {
        return Err(bad());
    }
    let (kind, count) = match kind.split_once('[') {
        None => (kind, Count::One),
        Some((kind, size)) => {
            let size = size.strip_suffix(']').ok_or_else(bad)?;
            match size {
                "" => (kind, Count::Any),
                size if size.starts_with("<=") => (kind, Count::Any),
                size => (kind, Count::Fixed(size.parse().map_err(|_| bad())?)),
            }
        }
    };
    let kind = kind.split("<=").next().unwrap_or(kind);
    if names.len() > MOST_FIELDS {
        return Err("its schema has more than 10,000 types".into());
    }
    let of = match kind {
        "string" => Type::Text,
        "wstring" => Type::Wide,
        _ => match Plain::named(kind) {
            Some(plain) => Type::Plain(plain),
            None => {
                let full = match kind {
                    "Header" => "std_msgs/Header".to_owned(),
                    "time" | "duration" => kind.to_owned(),
                    kind if kind.contains(['/', ':']) => short(kind),
                    kind => format!("{package}/{kind}"),
                };
                let at = names.iter().position(|name| *name == full).unwrap_or_else(|| {
                    names.push(full);
                    names.len() - 1
                });
                Type::Record(at)
            }
        },
    };
    Ok(Some(Field { name: name.into(), of, count }))
}

/// How messages are written as bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// The Common Data Representation, behind four bytes that say which.
    Cdr,
    /// That of ROS 1: little-endian, without padding.
    Ros1,
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
    /// Greatest alignment, in bytes.
    widest: usize,
    form: Form,
    values: usize,
}

/// Decodes a message.
///
/// # Errors
/// What is wrong, in words.
pub(crate) fn decode<'a>(
    schema: &'a Schema,
    form: Form,
    bytes: &'a [u8],
) -> Result<Value<'a>, String> {
    let (body, little, widest) = match (form, bytes) {
        (Form::Ros1, _) => (bytes, true, 1),
        (Form::Cdr, [0, kind @ 0..=1, _, _, body @ ..]) => (body, *kind == 1, 8),
        (Form::Cdr, [0, kind @ 6..=7, _, _, body @ ..]) => (body, *kind == 7, 4),
        (Form::Cdr, [high, low, _, _, ..]) => {
            return Err(format!(
                "is in the representation {:#06x}",
                u16::from_be_bytes([*high, *low])
            ));
        }
        (Form::Cdr, _) => return Err(format!("has {} bytes", bytes.len())),
    };
    let values = MOST_VALUES.min(bytes.len().saturating_mul(VALUES_OF_A_BYTE) + 1_000);
    let mut reader = Reader { bytes: body, at: 0, little, widest, form, values };
    reader.record(schema, 0, 0).map_err(|(path, problem)| {
        let inside = if path.is_empty() { String::new() } else { format!(" in `{path}`") };
        format!("{problem}{inside}")
    })
}

/// Where in the message something is wrong, and what.
type Fault = (String, String);

impl<'a> Reader<'a> {
    fn take(&mut self, size: usize) -> Result<&'a [u8], Fault> {
        let end = self.at.checked_add(size).filter(|end| *end <= self.bytes.len());
        let Some(end) = end else { return Err((String::new(), "ends".into())) };
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn align(&mut self, size: usize) {
        let size = size.min(self.widest);
        self.at = self.at.next_multiple_of(size.max(1));
    }

    fn plain(&mut self, plain: Plain) -> Result<f64, Fault> {
        self.align(plain.size());
        let mut bytes = [0u8; 8];
        let size = plain.size();
        let taken = self.take(size)?;
        bytes[..size].copy_from_slice(taken);
        if !self.little {
            bytes[..size].reverse();
        }
        let bits = u64::from_le_bytes(bytes);
        Ok(match plain {
            Plain::Unsigned(_) => bits as f64,
            Plain::Signed(size) => {
                let unused = 64 - 8 * size as u32;
                ((bits << unused) as i64 >> unused) as f64
            }
            Plain::Float(4) => f64::from(f32::from_bits(bits as u32)),
            Plain::Float(_) => f64::from_bits(bits),
        })
    }

    fn length(&mut self) -> Result<usize, Fault> {
        let length = self.plain(Plain::Unsigned(4))? as usize;
        let left = self.bytes.len().saturating_sub(self.at);
        if length > left {
            return Err((String::new(), format!("counts {length} with {left} bytes left")));
        }
        Ok(length)
    }

    /// Counts a value or a field: many may take no bytes at all.
    fn charge(&mut self) -> Result<(), Fault> {
        let more = || (String::new(), "has more values than its bytes explain".to_owned());
        self.values = self.values.checked_sub(1).ok_or_else(more)?;
        Ok(())
    }

    fn value(&mut self, schema: &'a Schema, of: Type, depth: usize) -> Result<Value<'a>, Fault> {
        self.charge()?;
        Ok(match of {
            Type::Plain(plain) => Value::Number(self.plain(plain)?),
            Type::Text => {
                let length = self.length()?;
                let text = self.take(length)?;
                let text = text.strip_suffix(b"\0").unwrap_or(text);
                Value::Text(String::from_utf8_lossy(text))
            }
            Type::Wide => {
                return Err((String::new(), "has a `wstring`, which is not read,".into()));
            }
            Type::Record(index) => self.record(schema, index, depth + 1)?,
        })
    }

    fn record(
        &mut self,
        schema: &'a Schema,
        index: usize,
        depth: usize,
    ) -> Result<Value<'a>, Fault> {
        if depth > DEEPEST {
            return Err((String::new(), "has records in records, more than 32 deep,".into()));
        }
        let Some(fields) = schema.0.get(index) else { return Ok(Value::Missing) };
        if fields.is_empty() && self.form == Form::Cdr {
            // A record without fields has a byte in its place.
            self.take(1)?;
        }
        let mut found = Vec::with_capacity(fields.len());
        for field in fields {
            let value = self.field(schema, field, depth).map_err(|(path, problem)| {
                let dot = if path.is_empty() || path.starts_with('[') { "" } else { "." };
                (format!("{}{dot}{path}", field.name), problem)
            })?;
            found.push((field.name.as_str(), value));
        }
        Ok(Value::Record(found))
    }

    fn field(
        &mut self,
        schema: &'a Schema,
        field: &Field,
        depth: usize,
    ) -> Result<Value<'a>, Fault> {
        self.charge()?;
        let count = match field.count {
            Count::One => return self.value(schema, field.of, depth),
            Count::Fixed(count) => count,
            Count::Any => self.length()?,
        };
        if let Type::Plain(plain) = field.of
            && (count > LONGEST || field.name == "covariance")
        {
            if count > 0 {
                self.align(plain.size());
            }
            let size = count.checked_mul(plain.size());
            self.take(size.unwrap_or(usize::MAX))?;
            return Ok(Value::Missing);
        }
        let mut list = Vec::with_capacity(count.min(1024));
        for index in 0..count {
            let value = self.value(schema, field.of, depth).map_err(|(path, problem)| {
                let dot = if path.is_empty() { "" } else { "." };
                (format!("[{index}]{dot}{path}"), problem)
            })?;
            list.push(value);
        }
        Ok(Value::List(list))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/cdr.rs"]
mod tests;
