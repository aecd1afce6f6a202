// Photometric quantities with their dimension in the type: lux and cd/m² cannot be mixed up at a seam.
// Base units: metre, steradian, lumen. No constructor from a bare number outside this file and no accessor
// without a unit: write 1200.0 * cd, read .in(cd). Feet and degrees exist only in parsers and user-facing text.
#pragma once

#include <numbers>

namespace gonio {

template <int LengthExponent, int SolidAngleExponent, int FluxExponent>
class Quantity {
public:
    constexpr Quantity() = default;
    static constexpr Quantity from_base(double value) { return Quantity(value); }
    constexpr double base() const { return value_; }
    constexpr double in(Quantity unit) const { return value_ / unit.value_; }

    constexpr Quantity operator+(Quantity other) const { return Quantity(value_ + other.value_); }
    constexpr Quantity operator-(Quantity other) const { return Quantity(value_ - other.value_); }
    constexpr Quantity operator-() const { return Quantity(-value_); }
    constexpr Quantity operator*(double factor) const { return Quantity(value_ * factor); }
    constexpr Quantity operator/(double divisor) const { return Quantity(value_ / divisor); }
    constexpr double operator/(Quantity other) const { return value_ / other.value_; }
    constexpr auto operator<=>(const Quantity&) const = default;
    friend constexpr Quantity operator*(double factor, Quantity q) { return q * factor; }

private:
    explicit constexpr Quantity(double value) : value_(value) {}
    double value_ = 0.0;
};

template <int L1, int S1, int F1, int L2, int S2, int F2>
constexpr auto operator*(Quantity<L1, S1, F1> a, Quantity<L2, S2, F2> b) {
    return Quantity<L1 + L2, S1 + S2, F1 + F2>::from_base(a.base() * b.base());
}
template <int L1, int S1, int F1, int L2, int S2, int F2>
requires(L1 != L2 || S1 != S2 || F1 != F2) constexpr auto operator/(Quantity<L1, S1, F1> a, Quantity<L2, S2, F2> b) {
    return Quantity<L1 - L2, S1 - S2, F1 - F2>::from_base(a.base() / b.base());
}

using Length = Quantity<1, 0, 0>;
using Area = Quantity<2, 0, 0>;
using SolidAngle = Quantity<0, 1, 0>;
using LuminousFlux = Quantity<0, 0, 1>;
using LuminousIntensity = Quantity<0, -1, 1>;
using Illuminance = Quantity<-2, 0, 1>;
using Luminance = Quantity<-2, -1, 1>;

inline constexpr Length m = Length::from_base(1.0);
inline constexpr Length foot = Length::from_base(0.3048);
inline constexpr SolidAngle sr = SolidAngle::from_base(1.0);
inline constexpr LuminousFlux lm = LuminousFlux::from_base(1.0);
inline constexpr LuminousIntensity cd = LuminousIntensity::from_base(1.0);
inline constexpr Illuminance lx = Illuminance::from_base(1.0);
inline constexpr Luminance nit = Luminance::from_base(1.0);

// A plane angle. Its own type: neither a bare number nor a solid angle.
class Angle {
public:
    constexpr Angle() = default;
    static constexpr Angle radians(double value) { return Angle(value); }
    static constexpr Angle degrees(double value) { return Angle(value * std::numbers::pi / 180.0); }
    constexpr double radians() const { return radians_; }
    constexpr double degrees() const { return radians_ * 180.0 / std::numbers::pi; }
    constexpr auto operator<=>(const Angle&) const = default;

private:
    explicit constexpr Angle(double value) : radians_(value) {}
    double radians_ = 0.0;
};

}  // namespace gonio
