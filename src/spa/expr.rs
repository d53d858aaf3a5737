//! Expressions over the names of a vocabulary, such as `PRECONDITION * (NUT_IN_JIG + BOLT_IN_JIG)`.
//!
//! `+` and `-` add and subtract. `*` binds two pointers, or scales a pointer by a number; directly between a number and a
//! name it may be left out, as in `0.8 NUT`. `~` or `!` inverts and a leading `-` negates. `*` binds more tightly than `+` and `-`. An unknown name is an error; expressions never create names.

use super::error::VocabError;

/// A parsed expression.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Expr {
    Number(f64),
    Name {
        name: String,
        at: usize,
    },
    Negate(Box<Expr>),
    Invert(Box<Expr>, usize),
    /// Left side, right side, and position of the operator.
    Add(Box<Expr>, Box<Expr>, usize),
    Subtract(Box<Expr>, Box<Expr>, usize),
    Times(Box<Expr>, Box<Expr>),
}

/// Greatest depth of nested parentheses and prefix operators.
const MAX_DEPTH: usize = 64;
/// Greatest number of operators between operands.
const MAX_OPERATORS: usize = 1_000;

/// Parses `text`. Costs O(length).
pub(crate) fn parse(text: &str) -> Result<Expr, VocabError> {
    let mut parser = Parser { text, chars: text.chars().collect(), at: 0, depth: 0, operators: 0 };
    let expr = parser.sum()?;
    parser.space();
    if parser.at < parser.chars.len() {
        return Err(parser.wrong("an operator `+`, `-`, `*` or the end"));
    }
    Ok(expr)
}

/// Returns whether `name` can stand in an expression.
pub(crate) fn is_name(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_uppercase())
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

struct Parser<'a> {
    text: &'a str,
    chars: Vec<char>,
    at: usize,
    depth: usize,
    operators: usize,
}

impl Parser<'_> {
    fn space(&mut self) {
        while self.chars.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
    }

    fn peek(&mut self) -> Option<char> {
        self.space();
        self.chars.get(self.at).copied()
    }

    fn wrong(&mut self, expected: &'static str) -> VocabError {
        self.space();
        let problem =
            self.chars.get(self.at).map_or_else(|| "the end".into(), |c| format!("`{c}`"));
        VocabError::Syntax { text: self.text.into(), at: self.at, problem, expected }
    }

    fn sum(&mut self) -> Result<Expr, VocabError> {
        let mut left = self.product()?;
        while let Some(sign @ ('+' | '-')) = self.peek() {
            let at = self.at;
            self.operator()?;
            self.at += 1;
            let right = Box::new(self.product()?);
            left = match sign {
                '+' => Expr::Add(Box::new(left), right, at),
                _ => Expr::Subtract(Box::new(left), right, at),
            };
        }
        Ok(left)
    }

    fn product(&mut self) -> Result<Expr, VocabError> {
        let mut left = self.factor()?;
        loop {
            match self.peek() {
                Some('*') => {
                    self.operator()?;
                    self.at += 1;
                }
                Some(next) if next.is_ascii_uppercase() && matches!(left, Expr::Number(_)) => {}
                _ => return Ok(left),
            }
            left = Expr::Times(Box::new(left), Box::new(self.factor()?));
        }
    }

    /// Counts an operator. Long chains would exhaust the stack when they are evaluated.
    fn operator(&mut self) -> Result<(), VocabError> {
        self.operators += 1;
        if self.operators <= MAX_OPERATORS {
            return Ok(());
        }
        let problem = format!("operator number {}", self.operators);
        let expected = "an expression of at most 1000 operators";
        Err(VocabError::Syntax { text: self.text.into(), at: self.at, problem, expected })
    }

    fn factor(&mut self) -> Result<Expr, VocabError> {
        const EXPECTED: &str = "a name, a number, `~`, `-` or `(`";
        let Some(next) = self.peek() else { return Err(self.wrong(EXPECTED)) };
        let at = self.at;
        if matches!(next, '~' | '!' | '-' | '(') {
            if self.depth == MAX_DEPTH {
                return Err(VocabError::Syntax {
                    text: self.text.into(),
                    at,
                    problem: format!("nesting deeper than {MAX_DEPTH}"),
                    expected: "a flatter expression",
                });
            }
            self.depth += 1;
            self.at += 1;
            let inner = match next {
                '~' | '!' => Expr::Invert(Box::new(self.factor()?), at),
                '-' => Expr::Negate(Box::new(self.factor()?)),
                _ => {
                    let inner = self.sum()?;
                    if self.peek() != Some(')') {
                        return Err(self.wrong("`)`"));
                    }
                    self.at += 1;
                    inner
                }
            };
            self.depth -= 1;
            return Ok(inner);
        }
        if next.is_ascii_digit() || next == '.' {
            return self.number();
        }
        if next.is_ascii_uppercase() {
            let name: String = self.chars[at..]
                .iter()
                .take_while(|c| c.is_ascii_alphanumeric() || **c == '_')
                .collect();
            self.at += name.len();
            return Ok(Expr::Name { name, at });
        }
        Err(self.wrong(EXPECTED))
    }

    fn number(&mut self) -> Result<Expr, VocabError> {
        let at = self.at;
        let digits: String =
            self.chars[at..].iter().take_while(|c| c.is_ascii_digit() || **c == '.').collect();
        match digits.parse::<f64>() {
            Ok(value) if value.is_finite() && value <= f64::from(f32::MAX) => {
                self.at += digits.len();
                Ok(Expr::Number(value))
            }
            _ => Err(VocabError::Syntax {
                text: self.text.into(),
                at,
                problem: format!("`{digits}`"),
                expected: "a number such as `0.5`",
            }),
        }
    }
}
