//! Formulas as graphs: what is written twice stands in a graph once.

use super::arithmetic::Arithmetic;
use std::collections::HashMap;

/// The number of a node in its graph.
pub type Id = u32;

/// The most nodes of a formula. The code of a larger one takes a compiler minutes.
pub const MAX_NODES: usize = 2000;

/// An operation, or what it begins with. Operands come before the node in its graph.
#[expect(missing_docs, reason = "they are what they are called")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Node {
    X,
    Y,
    Z,
    Number(f64),
    Add(Id, Id),
    Subtract(Id, Id),
    Multiply(Id, Id),
    Divide(Id, Id),
    Negate(Id),
    Square(Id),
    Sqrt(Id),
    Abs(Id),
    Min(Id, Id),
    Max(Id, Id),
    Sin(Id),
    Cos(Id),
    Exp(Id),
    Log(Id),
}

/// A real function of x, y and z.
///
/// It has a value everywhere: the square root of a negative number counts as 0, the logarithm of what is not positive as that of
/// 10⁻³⁰, a number divided by less than 10⁻³⁰ is divided by that, and the exponential of more than 80 is that of 80.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    nodes: Vec<Node>,
    result: Id,
}

impl Formula {
    /// The nodes, operands first.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The node whose value is that of the formula.
    pub fn result(&self) -> Id {
        self.result
    }

    /// Its value, in any arithmetic.
    pub fn evaluate<T: Arithmetic>(&self, [x, y, z]: [T; 3]) -> T {
        let mut values: Vec<T> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let at = |id: Id| values[id as usize];
            let value = match *node {
                Node::X => x,
                Node::Y => y,
                Node::Z => z,
                Node::Number(n) => T::number(n),
                Node::Add(a, b) => at(a).add(at(b)),
                Node::Subtract(a, b) => at(a).subtract(at(b)),
                Node::Multiply(a, b) => at(a).multiply(at(b)),
                Node::Divide(a, b) => at(a).multiply(at(b).inverse()),
                Node::Negate(a) => at(a).negate(),
                Node::Square(a) => at(a).square(),
                Node::Sqrt(a) => at(a).sqrt(),
                Node::Abs(a) => at(a).abs(),
                Node::Min(a, b) => at(a).min(at(b)),
                Node::Max(a, b) => at(a).max(at(b)),
                Node::Sin(a) => at(a).sin(),
                Node::Cos(a) => at(a).cos(),
                Node::Exp(a) => at(a).exp(),
                Node::Log(a) => at(a).log(),
            };
            values.push(value);
        }
        values[self.result as usize]
    }
}

/// A graph that grows.
#[derive(Debug, Default)]
pub(super) struct Graph {
    nodes: Vec<Node>,
    known: HashMap<(u8, u64, u64), Id>,
}

impl Graph {
    /// The formula whose value is that of `result`; nodes that it does not need are left out.
    pub(super) fn formula(self, result: Id) -> Formula {
        let mut needed = vec![false; self.nodes.len()];
        needed[result as usize] = true;
        for (k, node) in self.nodes.iter().enumerate().rev() {
            if needed[k] {
                for id in node.operands().into_iter().flatten() {
                    needed[id as usize] = true;
                }
            }
        }
        let mut renamed = vec![0; self.nodes.len()];
        let mut nodes = Vec::new();
        for (k, node) in self.nodes.iter().enumerate() {
            if needed[k] {
                renamed[k] = nodes.len() as Id;
                nodes.push(node.renamed(|id| renamed[id as usize]));
            }
        }
        Formula {
            result: renamed[result as usize],
            nodes,
        }
    }

    /// How many nodes there are.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The value of a node that is a number.
    pub(super) fn constant(&self, id: Id) -> Option<f64> {
        match self.nodes[id as usize] {
            Node::Number(n) => Some(n),
            _ => None,
        }
    }

    pub(super) fn number(&mut self, n: f64) -> Id {
        self.intern(Node::Number(n + 0.0))
    }

    /// The node, or a simpler one with the same value.
    pub(super) fn add(&mut self, node: Node) -> Id {
        let operands = node.operands();
        let constants = operands.map(|id| id.and_then(|id| self.constant(id)));
        if operands[0].is_some() && (0..2).all(|k| operands[k].is_none() || constants[k].is_some())
        {
            return self.number(node.of_numbers(constants.map(|c| c.unwrap_or_default())));
        }
        match (node, constants) {
            (Node::Add(a, _) | Node::Subtract(a, _), [_, Some(0.0)]) => a,
            (Node::Add(_, b), [Some(0.0), _]) => b,
            (Node::Multiply(a, _) | Node::Divide(a, _), [_, Some(1.0)]) => a,
            (Node::Multiply(_, b), [Some(1.0), _]) => b,
            (Node::Multiply(a, b), _) if a == b => self.intern(Node::Square(a)),
            (Node::Divide(a, _), [_, Some(n)]) if n != 0.0 => {
                let inverse = self.number(1.0 / n);
                self.add(Node::Multiply(a, inverse))
            }
            // Numbers come second, so that code need look at one side alone.
            (Node::Multiply(a, b), [Some(_), None]) => self.intern(Node::Multiply(b, a)),
            (Node::Add(a, b), [Some(_), None]) => self.intern(Node::Add(b, a)),
            _ => self.intern(node),
        }
    }

    /// `base` to a power that is a number.
    pub(super) fn power(&mut self, base: Id, exponent: f64) -> Id {
        if exponent < 0.0 {
            let one = self.number(1.0);
            let below = self.power(base, -exponent);
            return self.add(Node::Divide(one, below));
        }
        let whole = exponent.floor();
        if whole <= 64.0 && exponent == whole {
            return self.whole_power(base, whole as u32);
        }
        if whole <= 64.0 && exponent - whole == 0.5 {
            let root = self.add(Node::Sqrt(base));
            let power = self.whole_power(base, whole as u32);
            return self.add(Node::Multiply(power, root));
        }
        // Of a large whole power the sign is that of the base if it is odd.
        if exponent == whole && exponent % 2.0 == 1.0 {
            let even = self.power(base, exponent - 1.0);
            return self.add(Node::Multiply(even, base));
        }
        let base = if exponent == whole {
            self.add(Node::Abs(base))
        } else {
            base
        };
        let log = self.add(Node::Log(base));
        let exponent = self.number(exponent);
        let product = self.add(Node::Multiply(log, exponent));
        self.add(Node::Exp(product))
    }

    fn whole_power(&mut self, base: Id, exponent: u32) -> Id {
        match exponent {
            0 => self.number(1.0),
            1 => base,
            n if n % 2 == 0 => {
                let half = self.whole_power(base, n / 2);
                self.add(Node::Square(half))
            }
            n => {
                let below = self.whole_power(base, n - 1);
                self.add(Node::Multiply(below, base))
            }
        }
    }

    fn intern(&mut self, node: Node) -> Id {
        let nodes = &mut self.nodes;
        *self.known.entry(node.key()).or_insert_with(|| {
            nodes.push(node);
            (nodes.len() - 1) as Id
        })
    }
}

impl Node {
    /// What it is made of.
    pub fn operands(&self) -> [Option<Id>; 2] {
        match *self {
            Self::X | Self::Y | Self::Z | Self::Number(_) => [None, None],
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Min(a, b)
            | Self::Max(a, b) => [Some(a), Some(b)],
            Self::Negate(a)
            | Self::Square(a)
            | Self::Sqrt(a)
            | Self::Abs(a)
            | Self::Sin(a)
            | Self::Cos(a)
            | Self::Exp(a)
            | Self::Log(a) => [Some(a), None],
        }
    }

    /// Numbers that tell it from every other node: what it does, and its operands or its value.
    pub fn key(&self) -> (u8, u64, u64) {
        let kind = match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
            Self::Number(_) => 3,
            Self::Add(..) => 4,
            Self::Subtract(..) => 5,
            Self::Multiply(..) => 6,
            Self::Divide(..) => 7,
            Self::Negate(_) => 8,
            Self::Square(_) => 9,
            Self::Sqrt(_) => 10,
            Self::Abs(_) => 11,
            Self::Min(..) => 12,
            Self::Max(..) => 13,
            Self::Sin(_) => 14,
            Self::Cos(_) => 15,
            Self::Exp(_) => 16,
            Self::Log(_) => 17,
        };
        if let Self::Number(n) = self {
            return (kind, n.to_bits(), 0);
        }
        let [a, b] = self.operands().map(|id| id.map_or(u64::MAX, u64::from));
        (kind, a, b)
    }

    fn renamed(&self, name: impl Fn(Id) -> Id) -> Self {
        match *self {
            Self::X | Self::Y | Self::Z | Self::Number(_) => *self,
            Self::Add(a, b) => Self::Add(name(a), name(b)),
            Self::Subtract(a, b) => Self::Subtract(name(a), name(b)),
            Self::Multiply(a, b) => Self::Multiply(name(a), name(b)),
            Self::Divide(a, b) => Self::Divide(name(a), name(b)),
            Self::Min(a, b) => Self::Min(name(a), name(b)),
            Self::Max(a, b) => Self::Max(name(a), name(b)),
            Self::Negate(a) => Self::Negate(name(a)),
            Self::Square(a) => Self::Square(name(a)),
            Self::Sqrt(a) => Self::Sqrt(name(a)),
            Self::Abs(a) => Self::Abs(name(a)),
            Self::Sin(a) => Self::Sin(name(a)),
            Self::Cos(a) => Self::Cos(name(a)),
            Self::Exp(a) => Self::Exp(name(a)),
            Self::Log(a) => Self::Log(name(a)),
        }
    }

    /// Its value if its operands are these.
    fn of_numbers(&self, [a, b]: [f64; 2]) -> f64 {
        let formula = Formula {
            nodes: vec![Node::Number(a), Node::Number(b), self.renamed_to_first()],
            result: 2,
        };
        formula.evaluate([0.0; 3])
    }

    fn renamed_to_first(&self) -> Self {
        let second = self.operands()[1];
        // One operand twice has one value, which is that of both.
        self.renamed(|id| u32::from(Some(id) == second && self.operands()[0] != second))
    }
}
