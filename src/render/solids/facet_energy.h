// SPDX-License-Identifier: MIT
// What facets of GGX reflect at one meeting, were they white: the rest meets further facets, and a rough
// surface that left it out would be too dark (Kulla & Conty 2017, "Revisiting physically based shading at
// Imageworks").
#pragma once

namespace firn {

// Of light from a direction with this cosine to the normal, in [0, 1]. roughness: the root of GGX's alpha.
float facet_energy(float roughness, float cosine);
// Of light from everywhere alike: the mean of the above over cosine^2.
float mean_facet_energy(float roughness);

}  // namespace firn
