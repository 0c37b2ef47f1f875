// Index of the triangle a hit shader was called for. Needs bindings.glsl and payload.glsl.

uint triangle_index() {
    const Instance instance = params.scene.at[0].instances.at[gl_InstanceCustomIndexEXT & INSTANCE_INDEX];
    return (gl_GeometryIndexEXT == 0 ? instance.opaque_base : instance.alpha_base) + gl_PrimitiveID;
}
