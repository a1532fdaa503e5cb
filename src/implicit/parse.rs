//! Formulas as text: sums, products, powers and functions, as one writes them on paper.
//!
//! The parser is our own. What crates there are make numbers of a text, and keep no tree to be differentiated and made into code.

use super::formula::{Formula, Graph, Id, MAX_NODES, Node};

/// Brackets, signs and powers in each other beyond this are refused.
const MAX_DEPTH: usize = 100;

/// Numbers beyond this do not fit the kernels' f32 together with their products.
const LARGEST_NUMBER: f64 = 1e15;

/// What becomes of numbers alone stays below this, within the range of the kernels' f32.
const LARGEST_RESULT: f64 = 1e30;

/// The functions of one argument, and of two.
const FUNCTIONS: [(&str, usize); 9] = [
    ("sqrt", 1),
    ("abs", 1),
    ("sin", 1),
    ("cos", 1),
    ("tan", 1),
    ("exp", 1),
    ("log", 1),
    ("min", 2),
    ("max", 2),
];

/// What is wrong with a formula, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column} of the formula: {message}")]
pub struct WrongFormula {
    /// Line in its text, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// Whether a parameter may have this name: letters, digits and underscores, and no word of formulas.
pub(super) fn may_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters
        .next()
        .is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !["x", "y", "z", "pi"].contains(&name)
        && FUNCTIONS.iter().all(|f| f.0 != name)
}

/// The formula that `text` says, with these parameters.
pub(super) fn parse(text: &str, parameters: &[(String, f64)]) -> Result<Formula, WrongFormula> {
    let mut parser = Parser {
        text,
        at: 0,
        depth: 0,
        parameters,
        graph: Graph::default(),
    };
    let result = parser.sum()?;
    match parser.peek() {
        None => Ok(parser.graph.formula(result)),
        Some(')') => Err(parser.wrong("this bracket closes nothing")),
        Some(c) => Err(parser.unexpected(c)),
    }
}

/// Functions that others know by these names, and what stands for them here.
const OTHERS: [(&str, &str); 7] = [
    ("pow", POWERS),
    ("sqr", POWERS),
    ("square", POWERS),
    ("cube", POWERS),
    ("ln", "; the natural logarithm is log"),
    ("length", "; distances are written sqrt(x^2 + y^2 + z^2)"),
    ("fabs", "; the absolute value is abs"),
];

const POWERS: &str = "; powers are written x^2";

struct Parser<'a> {
    text: &'a str,
    /// The byte that is next.
    at: usize,
    depth: usize,
    parameters: &'a [(String, f64)],
    graph: Graph,
}

impl Parser<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    /// The next character that is no space.
    fn peek(&mut self) -> Option<char> {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
        self.rest().chars().next()
    }

    /// Takes the next character if it is one of these.
    fn take(&mut self, any: &[char]) -> bool {
        match self.peek() {
            Some(c) if any.contains(&c) => {
                self.at += c.len_utf8();
                true
            }
            _ => false,
        }
    }

    /// The error of a character after a whole expression.
    fn unexpected(&self, c: char) -> WrongFormula {
        let hint = match c {
            '²' | '³' | '⁴' => POWERS,
            '=' | '<' | '>' => {
                "; move everything to one side: the surface is where the formula is 0"
            }
            _ => "",
        };
        self.wrong(&format!(
            "{c:?} is not expected here; allowed: + - * / ^, a name, or a bracket{hint}"
        ))
    }

    fn wrong(&self, message: &str) -> WrongFormula {
        self.wrong_at(self.at, message)
    }

    fn wrong_at(&self, at: usize, message: &str) -> WrongFormula {
        let before = &self.text[..at];
        let line_start = before.rfind('\n').map_or(0, |k| k + 1);
        WrongFormula {
            line: 1 + before.matches('\n').count(),
            column: 1 + before[line_start..].chars().count(),
            message: message.into(),
        }
    }

    fn node(&mut self, node: Node) -> Result<Id, WrongFormula> {
        if self.graph.len() >= MAX_NODES {
            let message = format!("the formula has more than {MAX_NODES} operations");
            return Err(self.wrong(&message));
        }
        let id = self.graph.add(node);
        self.finite(id)
    }

    /// The node, unless it is a number that is none.
    fn finite(&self, id: Id) -> Result<Id, WrongFormula> {
        match self.graph.constant(id) {
            Some(n) if n.is_nan() || n.abs() > LARGEST_RESULT => {
                let message =
                    format!("numbers give {n:e} here; they must stay below {LARGEST_RESULT:e}");
                Err(self.wrong(&message))
            }
            _ => Ok(id),
        }
    }

    fn sum(&mut self) -> Result<Id, WrongFormula> {
        let mut left = self.product()?;
        loop {
            left = if self.take(&['+']) {
                let right = self.product()?;
                self.node(Node::Add(left, right))?
            } else if self.take(&['-', '−']) {
                let right = self.product()?;
                self.node(Node::Subtract(left, right))?
            } else {
                return Ok(left);
            };
        }
    }

    fn product(&mut self) -> Result<Id, WrongFormula> {
        let mut left = self.signed()?;
        loop {
            left = if self.take(&['/']) {
                let right = self.signed()?;
                self.node(Node::Divide(left, right))?
            } else if self.take(&['*', '·']) {
                let right = self.signed()?;
                self.node(Node::Multiply(left, right))?
            } else if self.peek().is_some_and(|c| c == '(' || starts_name(c)) {
                // What stands side by side is multiplied.
                let right = self.power()?;
                self.node(Node::Multiply(left, right))?
            } else {
                return Ok(left);
            };
        }
    }

    fn signed(&mut self) -> Result<Id, WrongFormula> {
        if self.take(&['+']) {
            self.nested(Self::signed)
        } else if self.take(&['-', '−']) {
            let value = self.nested(Self::signed)?;
            self.node(Node::Negate(value))
        } else {
            self.power()
        }
    }

    fn power(&mut self) -> Result<Id, WrongFormula> {
        let base = self.atom()?;
        if !self.take(&['^']) {
            return Ok(base);
        }
        let exponent = self.nested(Self::signed)?;
        match self.graph.constant(exponent) {
            Some(exponent) => {
                let power = self.graph.power(base, exponent);
                self.finite(power)
            }
            None => {
                let log = self.node(Node::Log(base))?;
                let product = self.node(Node::Multiply(log, exponent))?;
                self.node(Node::Exp(product))
            }
        }
    }

    fn nested(
        &mut self,
        read: fn(&mut Self) -> Result<Id, WrongFormula>,
    ) -> Result<Id, WrongFormula> {
        if self.depth == MAX_DEPTH {
            let message = format!("more than {MAX_DEPTH} brackets, signs or powers in each other");
            return Err(self.wrong(&message));
        }
        self.depth += 1;
        let result = read(self);
        self.depth -= 1;
        result
    }

    fn atom(&mut self) -> Result<Id, WrongFormula> {
        match self.peek() {
            Some('(') => self.bracket(),
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if starts_name(c) => self.name(),
            Some(c) => {
                let twice = c == '*' && self.text[..self.at].ends_with('*');
                let hint = if twice { POWERS } else { "" };
                Err(self.wrong(&format!(
                    "{c:?} is not expected here; expected a number, a name, or a bracket{hint}"
                )))
            }
            None => {
                Err(self
                    .wrong("the formula ends where a number, a name, or a bracket should follow"))
            }
        }
    }

    fn bracket(&mut self) -> Result<Id, WrongFormula> {
        let opened = self.at;
        self.take(&['(']);
        let value = self.nested(Self::sum)?;
        self.close(opened)?;
        Ok(value)
    }

    /// Takes the bracket that closes the one at `opened`.
    fn close(&mut self, opened: usize) -> Result<(), WrongFormula> {
        if self.take(&[')']) {
            return Ok(());
        }
        match self.peek() {
            None => Err(self.wrong_at(opened, "this bracket is never closed")),
            Some(c) => Err(self.unexpected(c)),
        }
    }

    fn number(&mut self) -> Result<Id, WrongFormula> {
        let rest = self.rest();
        let digits = |s: &str| s.bytes().take_while(u8::is_ascii_digit).count();
        let mut length = digits(rest);
        if rest[length..].starts_with('.') {
            length += 1 + digits(&rest[length + 1..]);
        }
        // An exponent has digits; a lone e is a name.
        if let Some(after) = rest[length..].strip_prefix(['e', 'E']) {
            let sign = usize::from(after.starts_with(['+', '-']));
            let exponent = digits(&after[sign..]);
            if exponent > 0 {
                length += 1 + sign + exponent;
            }
        }
        let text = &rest[..length];
        match text.parse::<f64>() {
            Ok(n) if n <= LARGEST_NUMBER => {
                self.at += length;
                Ok(self.graph.number(n))
            }
            Ok(_) => {
                let message =
                    format!("{text} is too large; numbers are at most {LARGEST_NUMBER:e}");
                Err(self.wrong(&message))
            }
            Err(_) => Err(self.wrong(&format!("{text:?} is no number"))),
        }
    }

    fn name(&mut self) -> Result<Id, WrongFormula> {
        let start = self.at;
        let rest = self.rest();
        let length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let name = rest[..length.unwrap_or(rest.len())].to_owned();
        self.at += name.len();
        if let Some((_, value)) = self.parameters.iter().find(|p| p.0 == name) {
            return Ok(self.graph.number(*value));
        }
        match name.as_str() {
            "x" => return self.node(Node::X),
            "y" => return self.node(Node::Y),
            "z" => return self.node(Node::Z),
            "pi" => return Ok(self.graph.number(std::f64::consts::PI)),
            _ => {}
        }
        let Some((_, wanted)) = FUNCTIONS.iter().find(|f| f.0 == name) else {
            let functions: Vec<&str> = FUNCTIONS.iter().map(|f| f.0).collect();
            let parameters: Vec<&str> = self.parameters.iter().map(|p| p.0.as_str()).collect();
            let own = if parameters.is_empty() {
                "no parameters".to_owned()
            } else {
                format!("the parameters {}", parameters.join(", "))
            };
            let other = OTHERS.iter().find(|(other, _)| *other == name);
            let message = format!(
                "unknown name {name:?}; known: x, y, z, pi, {}, and {own}{}",
                functions.join(", "),
                other.map_or("", |(_, hint)| hint)
            );
            return Err(self.wrong_at(start, &message));
        };
        if self.peek() != Some('(') {
            return Err(self.wrong(&format!("{name} needs its argument in brackets")));
        }
        let opened = self.at;
        self.take(&['(']);
        let mut arguments = vec![self.nested(Self::sum)?];
        while self.take(&[',']) {
            arguments.push(self.nested(Self::sum)?);
        }
        self.close(opened)?;
        match (name.as_str(), &arguments[..]) {
            ("sqrt", [a]) => self.node(Node::Sqrt(*a)),
            ("abs", [a]) => self.node(Node::Abs(*a)),
            ("sin", [a]) => self.node(Node::Sin(*a)),
            ("cos", [a]) => self.node(Node::Cos(*a)),
            ("tan", [a]) => {
                let (sin, cos) = (self.node(Node::Sin(*a))?, self.node(Node::Cos(*a))?);
                self.node(Node::Divide(sin, cos))
            }
            ("exp", [a]) => self.node(Node::Exp(*a)),
            ("log", [a]) => self.node(Node::Log(*a)),
            ("min" | "max", [first, rest @ ..]) if !rest.is_empty() => {
                let mut value = *first;
                for other in rest {
                    value = self.node(if name == "min" {
                        Node::Min(value, *other)
                    } else {
                        Node::Max(value, *other)
                    })?;
                }
                Ok(value)
            }
            _ => {
                let message = format!(
                    "{name} has {} here, and takes {}",
                    match arguments.len() {
                        1 => "1 argument".to_owned(),
                        n => format!("{n} arguments"),
                    },
                    if *wanted == 1 { "1" } else { "2 or more" },
                );
                Err(self.wrong_at(start, &message))
            }
        }
    }
}

fn starts_name(c: char) -> bool {
    c.is_ascii_alphabetic() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        let parameters = [("a".to_owned(), 2.5), ("r_0".to_owned(), -3.0)];
        let formula = parse(text, &parameters).unwrap_or_else(|e| panic!("{text}: {e}"));
        formula.evaluate([0.5, 2.0, -1.5])
    }

    #[test]
    fn formulas_mean_what_they_say() {
        let (x, y, z) = (0.5f64, 2.0f64, -1.5f64);
        for (text, expected) in [
            ("x + y z", x + y * z),
            ("-x^2", -(x * x)),
            ("2^-1 x", 0.5 * x),
            ("2^3^0.5", 2f64.powf(3f64.sqrt())),
            ("x - y - z", x - y - z),
            ("12 / y / 2", 3.0),
            ("4 (x^2 + y^2)", 4.0 * (x * x + y * y)),
            ("(x+1)(y+1)", 4.5),
            ("x(y+1)", 1.5),
            ("a x^3 - r_0", 2.5 * 0.125 + 3.0),
            (
                "sqrt(y) + abs(z) + log(y) + exp(x)",
                2f64.sqrt() + 1.5 + 2f64.ln() + 0.5f64.exp(),
            ),
            ("min(x, y, z) max(x, y)", -3.0),
            (
                "sin(x) cos(y) + tan(x)",
                0.5f64.sin() * 2f64.cos() + 0.5f64.tan(),
            ),
            ("y^2.5 + y^0.3", 2f64.powf(2.5) + 2f64.powf(0.3)),
            ("y^x", 2f64.sqrt()),
            ("1e1 x · 2 − .5", 9.5),
            ("(-y)^71 / y^70", -2.0),
            ("(-y)^66 / y^66", 1.0),
            ("z^3 + z^4 + z^-2", z.powi(3) + z.powi(4) + 1.0 / (z * z)),
            ("sqrt(z) + pi", std::f64::consts::PI),
            ("min(2, 2) + 3 - 3 / 3", 4.0),
        ] {
            assert!(
                (value(text) - expected).abs() < 1e-12,
                "{text}: {} {expected}",
                value(text)
            );
        }
    }

    #[test]
    fn what_is_written_twice_is_computed_once() {
        let formula = parse("(x^2 + y^2 + z^2 + 0.91)^2 - 4 (x^2 + y^2)", &[]).expect("a torus");
        // x, y, z and their squares; two sums that differ; 0.91 and its sum, squared; 4 times; the difference.
        assert!(formula.nodes().len() <= 15, "{:?}", formula.nodes());
    }

    #[test]
    fn faults_are_found_where_they_are() {
        for (text, line, column, message) in [
            ("", 1, 1, "ends where"),
            ("x + ", 1, 5, "ends where"),
            ("x + * y", 1, 5, "'*' is not expected"),
            ("(x + y", 1, 1, "never closed"),
            ("x + y)", 1, 6, "closes nothing"),
            ("x\n  + q", 2, 5, "unknown name \"q\""),
            ("sin x", 1, 5, "argument in brackets"),
            ("sin(x, y)", 1, 1, "2 arguments here, and takes 1"),
            ("min(x)", 1, 1, "1 argument here, and takes 2 or more"),
            ("x $ y", 1, 3, "'$' is not expected"),
            ("x**2", 1, 3, "or a bracket; powers are written x^2"),
            ("x²", 1, 2, "or a bracket; powers are written x^2"),
            ("(x² + 1)", 1, 3, "powers are written x^2"),
            ("pow(x, 2)", 1, 1, "powers are written x^2"),
            ("sqr(y)", 1, 1, "powers are written x^2"),
            ("x = 1", 1, 3, "move everything to one side"),
            ("x < 1", 1, 3, "move everything to one side"),
            ("1e99", 1, 1, "too large"),
            ("x + (1e15^30 - 1e15^30)", 1, 14, "numbers give inf here"),
            ("1e15^2 * 1e15 * x", 1, 15, "they must stay below 1e30"),
            (".", 1, 1, "no number"),
            ("x 2", 1, 3, "'2' is not expected"),
            ("ä", 1, 1, "not expected"),
        ] {
            let wrong = parse(text, &[]).expect_err(text);
            assert_eq!(
                (wrong.line, wrong.column),
                (line, column),
                "{text}: {wrong}"
            );
            assert!(wrong.message.contains(message), "{text}: {wrong}");
        }
        assert!(parse(&"(".repeat(100_000), &[]).is_err());
        assert!(parse(&"-".repeat(100_000), &[]).is_err());
        assert!(parse(&"x^".repeat(100_000), &[]).is_err());
        assert!(parse(&"x+y*".repeat(100_000), &[]).is_err());
    }
}
