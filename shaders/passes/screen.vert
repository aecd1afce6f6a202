// One triangle over the viewport; with CUBE one per face of a cube map, from first_face on.
#ifdef CUBE
layout(location = 0) uniform int first_face;
flat out int face;
#endif
out vec2 ndc;
void main() {
    ndc = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(ndc, 0.5, 1.0);
#ifdef CUBE
    face = first_face + gl_InstanceID;
    gl_Layer = face;
#endif
}
