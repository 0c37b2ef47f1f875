// What the passes of the filter for noise share. The CPU twin is crates/viewer/src/denoise.rs, function for
// function. Needs nothing; naga's subset of GLSL.

// Light is that of a surface of at least this albedo.
const float LEAST_ALBEDO = 0.02;

float luminance(vec3 rgb) { return dot(rgb, vec3(0.2126, 0.7152, 0.0722)); }

// How far what is seen `there` belongs to the surface seen `here`, 0 to 1. A guide is two words: unit normal
// (0 where nothing is) and the spacing of what neighbouring pixels see; position and samples.
float alike(vec4 here_normal, vec4 here_position, vec4 there_normal, vec4 there_position) {
    float cosine = max(dot(here_normal.xyz, there_normal.xyz), 0.0);
    // To the power of 128.
    float power = cosine * cosine;
    power *= power;
    power *= power;
    power *= power;
    power *= power;
    power *= power;
    power *= power;
    float off = abs(dot(here_normal.xyz, there_position.xyz - here_position.xyz));
    return power * exp(-off / (here_normal.w + 1e-6));
}
