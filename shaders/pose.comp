// Models in poses: for each corner of each triangle its vertex, blended between two poses. One row of
// workgroups for each model. Plain storage buffers, so that naga compiles it.
#version 460

layout(local_size_x = 64) in;

// Vertices of all poses, three numbers each.
layout(set = 0, binding = 0, std430) readonly buffer Positions { float positions[]; };
// Vertices of all triangles' corners, counted within a pose.
layout(set = 0, binding = 1, std430) readonly buffer Indices { uint indices[]; };
// Two for each model: first vertex of the one pose and of the other, first corner among the indices,
// corners; then the bits of the fraction, and the first corner in the output.
layout(set = 0, binding = 2, std430) readonly buffer Jobs { uvec4 jobs[]; };
// Corners, three numbers each.
layout(set = 0, binding = 3, std430) buffer Corners { float corners[]; };

void main() {
    uint corner = gl_GlobalInvocationID.x;
    uvec4 job = jobs[2u * gl_WorkGroupID.y];
    uvec4 rest = jobs[2u * gl_WorkGroupID.y + 1u];
    if (corner >= job.w) {
        return;
    }
    float fraction = uintBitsToFloat(rest.x);
    uint vertex = indices[job.z + corner];
    uint a = 3u * (job.x + vertex);
    uint b = 3u * (job.y + vertex);
    uint to = 3u * (rest.y + corner);
    for (uint axis = 0u; axis < 3u; axis++) {
        float from = positions[a + axis];
        corners[to + axis] = from + (positions[b + axis] - from) * fraction;
    }
}
