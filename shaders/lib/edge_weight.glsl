// How far two surface points may share their indirect light.

// Result: 0..1; 1 on the same plane. facing: cosine between the normals; off_plane: distance of one point from the other's
// plane over the distance that is still near.
float edge_stopping_weight(float facing, float off_plane) {
    float f = max(0.0f, facing);
    float f2 = f * f;
    float f4 = f2 * f2;
    float near = max(0.0f, 1.0f - off_plane * off_plane);
    return f4 * f4 * near * near;
}
