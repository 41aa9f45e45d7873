//! Records that Rust and the shaders share. Rust says where members lie; what a shader says is read from its
//! SPIR-V, so that a test can compare both ([`shader_records`]).

use super::{
    embedded,
    error::{GpuError, Result},
    reflect,
};

/// A member of a record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Its name, which is the same in Rust and in the shaders.
    pub name: String,
    /// From the record's beginning [bytes].
    pub offset: usize,
    /// In bytes.
    pub size: usize,
}

/// How a record lies in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The name of the structure or of the block in the shaders.
    pub name: String,
    /// From one record to the next [bytes].
    pub size: usize,
    /// In the order of their offsets.
    pub members: Vec<Member>,
}

/// What Rust writes and a shader reads, or the other way round: declared by [`crate::record!`].
pub trait Record: bytemuck::NoUninit {
    /// The name of the structure or of the block in the shaders.
    const NAME: &str;

    /// How it lies in memory.
    fn layout() -> Layout;
}

/// A record as one shader has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaderRecord {
    /// File name of the shader.
    pub shader: String,
    /// Where members lie. A structure that the shader reads from no buffer itself is packed as GLSL's
    /// `scalar` packs it.
    pub layout: Layout,
    /// Whether it lies in a buffer or in push constants as it stands.
    pub laid_out: bool,
    /// Bytes from one to the next in all arrays of it.
    pub strides: Vec<usize>,
}

/// All records of all shaders of the program, but for blocks that only hold another record or an array.
pub fn shader_records() -> Result<Vec<ShaderRecord>> {
    let mut all = Vec::new();
    for (shader, bytes) in embedded::SHADERS {
        let refuse = |reason| GpuError::Shader { name: (*shader).to_owned(), reason };
        let found = reflect::words(bytes).and_then(|words| reflect::records(&words)).map_err(refuse)?;
        all.extend(found.into_iter().map(|record| ShaderRecord { shader: (*shader).to_owned(), ..record }));
    }
    Ok(all)
}

/// Bytes of what a function finds in a record: for [`crate::layout!`].
pub const fn size_of_member<T, M>(_: fn(&T) -> &M) -> usize {
    size_of::<M>()
}

/// Where the members of a structure lie: `layout!(Type = "Name" { member, … })`, with every member.
#[macro_export]
macro_rules! layout {
    ($kind:ty = $shader:literal { $($member:ident),* $(,)? }) => {{
        type Whole = $kind;
        // Does not compile where a member is missing.
        let _: fn(&Whole) = |whole| { let Whole { $($member: _),* } = whole; };
        $crate::Layout {
            name: $shader.to_owned(),
            size: size_of::<Whole>(),
            members: vec![$($crate::Member {
                name: stringify!($member).to_owned(),
                offset: std::mem::offset_of!(Whole, $member),
                size: $crate::size_of_member::<Whole, _>(|whole| &whole.$member),
            }),*],
        }
    }};
}

/// Declares a [`Record`]: `record! { /// … pub struct Rust = "Shader" { /// … pub member: f32, } }`.
#[macro_export]
macro_rules! record {
    ($(#[$attribute:meta])* $visible:vis struct $name:ident = $shader:literal {
        $($(#[$about:meta])* $seen:vis $member:ident: $kind:ty),* $(,)?
    }) => {
        $(#[$attribute])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        $visible struct $name { $($(#[$about])* $seen $member: $kind,)* }

        impl $crate::Record for $name {
            const NAME: &str = $shader;

            fn layout() -> $crate::Layout {
                $crate::layout!($name = $shader { $($member),* })
            }
        }
    };
}
