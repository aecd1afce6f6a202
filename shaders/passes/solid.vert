// The photometric solid at its luminaire, scaled to be seen; drawn as wireframe over the picture.
layout(location = 0) in vec3 in_position;  // luminaire frame, cd
layout(location = 1) in vec3 in_normal;
layout(location = 0) uniform mat4 clip_from_local;   // camera-relative world -> clip
layout(location = 1) uniform mat4 local_from_solid;  // luminaire frame in cd -> camera-relative world
out vec3 normal;
void main() {
    gl_Position = clip_from_local * (local_from_solid * vec4(in_position, 1.0));
    normal = mat3(local_from_solid) * in_normal;
}
