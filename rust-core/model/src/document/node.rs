//! The tree of a document, owned, with the bytes of each value in the file.

use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and its bytes in the file.
#[derive(Debug, Clone)]
pub struct Node {
    pub span: Range<usize>,
    pub content: Content,
}

/// The type and content of a value.
#[derive(Debug, Clone)]
pub enum Content {
    /// Digits and radix, as written: the reader of the key decides which range is valid.
    Integer(String, u32),
    Float(String),
    Text(String),
    Boolean(bool),
    Datetime,
    Array(Vec<Node>),
    Table(Table),
}

/// Keys with their places, in the order of the file.
#[derive(Debug, Clone, Default)]
pub struct Table {
    pub entries: Vec<Entry>,
}

/// A key and its value.
#[derive(Debug, Clone)]
pub struct Entry {
    pub key: String,
    pub key_span: Range<usize>,
    pub value: Node,
}

impl Table {
    /// Converts a parsed table; the parser has bounded how deeply it nests.
    pub fn new(table: DeTable<'_>) -> Table {
        let mut entries: Vec<Entry> = table
            .into_iter()
            .map(|(key, value)| Entry {
                key_span: key.span(),
                key: key.into_inner().into_owned(),
                value: Node::new(value),
            })
            .collect();
        entries.sort_by_key(|e| e.key_span.start);
        Table { entries }
    }

    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entries.iter().find(|e| e.key == key).map(|e| &e.value)
    }
}

impl Node {
    fn new(value: Spanned<DeValue<'_>>) -> Node {
        let span = value.span();
        let content = match value.into_inner() {
            DeValue::Integer(i) => Content::Integer(i.as_str().to_owned(), i.radix()),
            DeValue::Float(x) => Content::Float(x.as_str().to_owned()),
            DeValue::String(s) => Content::Text(s.into_owned()),
            DeValue::Boolean(b) => Content::Boolean(b),
            DeValue::Datetime(_) => Content::Datetime,
            DeValue::Array(items) => Content::Array(items.into_iter().map(Node::new).collect()),
            DeValue::Table(table) => Content::Table(Table::new(table)),
        };
        Node { span, content }
    }

    /// The name of the value's type in messages.
    pub fn type_name(&self) -> &'static str {
        match self.content {
            Content::Integer(..) => "an integer",
            Content::Float(_) => "a number",
            Content::Text(_) => "a string",
            Content::Boolean(_) => "true or false",
            Content::Datetime => "a date",
            Content::Array(_) => "an array",
            Content::Table(_) => "a table",
        }
    }
}
