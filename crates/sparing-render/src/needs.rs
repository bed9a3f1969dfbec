//! What a scene needs from the integrator, found out once at build time.
//!
//! What is not needed is not compiled into the specialised integrator that runs (see
//! [`crate::integrator`]), or not set up at all: no Embree filter functions, no lens samples, no sums.

bitflags::bitflags! {
    /// Parts of the renderer that a scene uses.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub struct Needs: u32 {
        /// Some texture or normal map reads texture coordinates.
        const TEXTURE_COORDINATES = 1 << 0;
        /// Some mesh has vertex normals, or there are curved analytic shapes.
        const SHADING_NORMALS = 1 << 1;
        /// Some material has a normal or bump map.
        const NORMAL_MAPS = 1 << 2;
        /// Some material has several lobes, or there is more than one light: extra random numbers.
        const CHOICE = 1 << 3;
        /// Some material is a mix.
        const MIXES = 1 << 4;
        /// There is a light that can be sampled and a surface that can be lit by it.
        const LIGHT_SAMPLING = 1 << 5;
        /// There is a sampled light that rays can also hit by chance.
        const MIS = 1 << 6;
        /// Light comes from infinity.
        const ENVIRONMENT = 1 << 7;
        /// Some surface emits.
        const EMISSION = 1 << 8;
        /// Some shape has cut-outs: an Embree filter function on that shape.
        const ALPHA = 1 << 9;
        /// The lens has a size.
        const DEPTH_OF_FIELD = 1 << 10;
        /// There are placed objects.
        const INSTANCES = 1 << 11;
        /// There are triangles.
        const TRIANGLES = 1 << 12;
        /// There are quads.
        const QUADS = 1 << 13;
        /// There are spheres.
        const SPHERES = 1 << 14;
        /// There are disks.
        const DISKS = 1 << 15;
        /// Albedo, normal and depth layers are asked for.
        const AUXILIARY = 1 << 16;
        /// Shapes are counted, for a policy or a layer.
        const SHAPE_COUNT = 1 << 17;
        /// Some material depends on the direction of texture coordinates: anisotropy, normal maps.
        const TANGENTS = 1 << 19;
        /// Some surface lets light through: the offset side has to follow the direction.
        const TRANSMISSION = 1 << 18;
        /// Some material uses the colours of vertices.
        const VERTEX_COLORS = 1 << 24;
        /// Some placement moves while the shutter is open.
        const MOTION = 1 << 25;
        /// The camera moves while the shutter is open.
        const CAMERA_MOTION = 1 << 26;
        /// Some texture is looked up by the second texture coordinates of a mesh.
        const SECOND_UVS = 1 << 27;
    }
}

impl Needs {
    /// Name and meaning of every flag, in order, for people.
    #[must_use]
    pub fn describe() -> Vec<(&'static str, Needs, &'static str)> {
        vec![
            (
                "texture-coordinates",
                Self::TEXTURE_COORDINATES,
                "interpolating texture coordinates, texture look-ups",
            ),
            ("shading-normals", Self::SHADING_NORMALS, "interpolating vertex normals"),
            ("normal-maps", Self::NORMAL_MAPS, "normal and bump maps"),
            ("choice", Self::CHOICE, "random numbers that choose lobes and lights"),
            ("mixes", Self::MIXES, "random numbers that choose between mixed materials"),
            ("light-sampling", Self::LIGHT_SAMPLING, "sampling lights, shadow rays"),
            ("mis", Self::MIS, "multiple importance sampling weights"),
            ("environment", Self::ENVIRONMENT, "light from infinity"),
            ("emission", Self::EMISSION, "emitting surfaces"),
            ("alpha", Self::ALPHA, "filter functions for cut-outs"),
            ("depth-of-field", Self::DEPTH_OF_FIELD, "lens samples"),
            ("instances", Self::INSTANCES, "instance transforms"),
            ("triangles", Self::TRIANGLES, "triangle intersection"),
            ("quads", Self::QUADS, "quad intersection"),
            ("spheres", Self::SPHERES, "sphere intersection"),
            ("disks", Self::DISKS, "disk intersection"),
            ("auxiliary", Self::AUXILIARY, "albedo, normal and depth sums"),
            ("shape-count", Self::SHAPE_COUNT, "sets of shapes per pixel"),
            ("tangents", Self::TANGENTS, "derivatives of the position by texture coordinates"),
            ("transmission", Self::TRANSMISSION, "light through surfaces"),
            ("vertex-colors", Self::VERTEX_COLORS, "interpolating the colours of vertices"),
            ("motion", Self::MOTION, "times of rays, placements at those times"),
            ("second-uvs", Self::SECOND_UVS, "interpolating the second texture coordinates"),
            ("camera-motion", Self::CAMERA_MOTION, "times of rays, the camera at those times"),
        ]
    }

    /// Names of the flags that are set.
    #[must_use]
    pub fn names(self) -> Vec<&'static str> {
        Self::describe().into_iter().filter(|d| self.contains(d.1)).map(|d| d.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flag_is_described_once() {
        let all = Needs::describe();
        assert_eq!(all.iter().fold(Needs::empty(), |n, d| n | d.1), Needs::all());
        assert_eq!(all.len(), Needs::all().bits().count_ones() as usize);
    }
}
