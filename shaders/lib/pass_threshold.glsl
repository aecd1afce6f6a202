// Which fragments of a surface that lets light pass are seen through, in one sample of a picture (stochastic
// transparency, Enderton et al. 2010): those whose share of passing light is above this. order: of a surface. Samples
// 0 … 15 take each sixteenth once, in an order of that surface's own, so that panes behind each other are independent;
// -1: a picture of one sample, without noise.
float pass_threshold(uint order, int pane_sample) {
    if (pane_sample < 0) return 0.5f;
    uint h = order * 0x9e3779b1u;
    h = (h ^ (h >> 15u)) * 0x85ebca6bu;
    h = (h ^ (h >> 13u)) * 0xc2b2ae35u;
    h = h ^ (h >> 16u);
    uint x = uint(pane_sample) & 15u;
    for (int turn = 0; turn < 4; ++turn) {  // each step maps 0 … 15 onto itself
        x = (x ^ h) & 15u;
        x = (x * ((h >> 3u & 14u) | 1u)) & 15u;
        x = x ^ (x >> 2u);
        h = h >> 8u | h << 24u;
    }
    return (float(x) + 0.5f) / 16.0f;
}
