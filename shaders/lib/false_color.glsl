// Where values lie on the scale of a false-colour view.

// Result: 0 at low, 1 at high, beyond them less or more. A logarithmic scale begins above 0.
float scale_position(float value, float low, float high, float logarithmic) {
    if (logarithmic > 0.5f) return log2(max(value, 1e-12f) / low) / log2(high / low);
    return (value - low) / (high - low);
}

// Result: of a position in 0..1 the middle of its step, of so many; 0 steps: itself.
float stepped_position(float t, float steps) { return steps < 1.0f ? t : (min(floor(t * steps), steps - 1.0f) + 0.5f) / steps; }
