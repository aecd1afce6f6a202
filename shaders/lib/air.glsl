// Haze whose density falls with the height (server/scene/haze.h).

// Result: the mean of exp(-y) over heights from low to high, in heights of the layer, 0 <= low <= high.
float layer_mean(float low, float high) {
    float x = high - low;
    float series = 1.0f - x * (0.5f - x * 0.1666667f);
    float whole = (1.0f - exp(-x)) / max(x, 1e-6f);
    return exp(-low) * mix(whole, series, x < 0.02f);
}
