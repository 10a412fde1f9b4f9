"""Newton's update of a pose that minimises the distances of marks from their measured points.

For a small motion u = (v, omega) of the target, P' = exp(u) P, half the sum f of squared distances
e in the image has the gradient -L' e. The contribution of each mark to its second derivatives is

    sum_r b_r b_r' - |e|^2 z z' + the quadratic form of v.(c x omega) + (c.omega)(P.omega),

with b_r = L_r + e_r z, z = (0, 0, 1/Z, y, -x, 0), c = (e_x, e_y, -(x e_x + y e_y)) / Z. For e = 0
the second derivatives are L' L, the matrix of the Gauss-Newton method. If a pixel of noise affects
the curvature of f as much as the perspective of a small target, the Gauss-Newton method needs about
30 updates and Newton's method five or six.
"""

from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import absolute, any_lane, get, put, where

LEAST_PIVOT = 1e-11  # of the diagonal: with a smaller pivot f is not convex, or hardly convex


@kernel
def _curvature_rows(w, N, now, inverse, error, L, B):
    """Compute B, the rows b_r of all marks."""
    for n in range(N):
        x, y, s = get(w, now + 2 * n), get(w, now + 2 * n + 1), get(w, inverse + n)
        for r in range(2):
            e, row = get(w, error + 2 * n + r), 12 * n + 6 * r
            for i in (0, 1, 5):
                put(w, B + row + i, get(w, L + row + i))
            put(w, B + row + 2, get(w, L + row + 2) + e * s)
            put(w, B + row + 3, get(w, L + row + 3) + e * y)
            put(w, B + row + 4, get(w, L + row + 4) - e * x)


@kernel
def _lower_gram(w, B, rows, H):
    """Compute the lower half of H = B' B in tiles of two rows and two columns.

    A single sum would wait for each addition; the four sums of a tile overlap.
    """
    for i in range(B, B + 6, 2):
        for j in range(B, i + 1, 2):
            a, b, c, d = get(w, i), get(w, i + 1), get(w, j), get(w, j + 1)
            ac, ad, bc, bd = a * c, a * d, b * c, b * d
            for r in range(6, 6 * rows, 6):
                a, b, c, d = get(w, i + r), get(w, i + 1 + r), get(w, j + r), get(w, j + 1 + r)
                ac, ad, bc, bd = ac + a * c, ad + a * d, bc + b * c, bd + b * d
            at = H + 6 * (i - B) + j - B
            put(w, at, ac)
            put(w, at + 1, ad)
            put(w, at + 6, bc)
            put(w, at + 7, bd)


@kernel
def _add_curvature_terms(w, N, now, inverse, error, weights, H):
    """Add the terms that are not products of rows b_r to the lower half of H.

    Errors and rows are weighted once, and the products in these terms must be weighted twice.
    """
    H2, H3, H4, H5 = H + 12, H + 18, H + 24, H + 30
    for n in range(N):
        x, y, s = get(w, now + 2 * n), get(w, now + 2 * n + 1), get(w, inverse + n)
        e, f, weight = get(w, error + 2 * n), get(w, error + 2 * n + 1), get(w, weights + n)
        size = e * e + f * f
        e, f = weight * e, weight * f
        c = -(e * x + f * y)
        put(w, H2 + 2, get(w, H2 + 2) - size * s * s)
        put(w, H3 + 1, get(w, H3 + 1) + 0.5 * c * s)
        put(w, H3 + 2, get(w, H3 + 2) - size * s * y - 0.5 * f * s)
        put(w, H3 + 3, get(w, H3 + 3) + (e * x - size * y * y))
        put(w, H4, get(w, H4) - 0.5 * c * s)
        put(w, H4 + 2, get(w, H4 + 2) + size * s * x + 0.5 * e * s)
        put(w, H4 + 3, get(w, H4 + 3) + (0.5 * (e * y + f * x) + size * x * y))
        put(w, H4 + 4, get(w, H4 + 4) + (f * y - size * x * x))
        put(w, H5, get(w, H5) + 0.5 * f * s)
        put(w, H5 + 1, get(w, H5 + 1) - 0.5 * e * s)
        put(w, H5 + 3, get(w, H5 + 3) + 0.5 * (e + c * x))
        put(w, H5 + 4, get(w, H5 + 4) + 0.5 * (f + c * y))
        put(w, H5 + 5, get(w, H5 + 5) + c)


@kernel
def _factorise_ldl(w, H):
    """Replace H by L and D^-1 with H = L D L', in place. Return the mask of too small pivots.

    The numbers of L D are stored above the diagonal.
    """
    small = get(w, H) <= 0.0
    for j in range(6):
        whole = get(w, H + 7 * j)
        pivot = whole
        for k in range(j):
            pivot = pivot - get(w, H + 6 * j + k) * get(w, H + 6 * k + j)
        small = small | (pivot <= LEAST_PIVOT * absolute(whole))
        inverse = 1.0 / pivot
        put(w, H + 7 * j, inverse)
        for i in range(j + 1, 6):
            total = get(w, H + 6 * i + j)
            for k in range(j):
                total = total - get(w, H + 6 * j + k) * get(w, H + 6 * k + i)
            put(w, H + 6 * j + i, total)
            put(w, H + 6 * i + j, total * inverse)
    return small


@part
def _solve_ldl(w, H, u):
    """Replace u by (L D L')^-1 u, in place."""
    for i in range(1, 6):
        total = get(w, u + i)
        for k in range(i):
            total = total - get(w, H + 6 * i + k) * get(w, u + k)
        put(w, u + i, total)
    for i in range(5, -1, -1):
        total = get(w, u + i) * get(w, H + 7 * i)
        for k in range(i + 1, 6):
            total = total - get(w, H + 6 * k + i) * get(w, u + k)
        put(w, u + i, total)


@part
def _descent_direction(w, L, error, rows, u):
    """Compute u = L' e, the negative gradient."""
    for i in range(6):
        total = get(w, L + i) * get(w, error)
        for r in range(1, rows):
            total = total + get(w, L + 6 * r + i) * get(w, error + r)
        put(w, u + i, total)


@part
def pose_hessian(w, N, now, inverse, error, weights, L, scratch):
    """Compute the lower half of the second derivatives H (6, 6) in scratch, after 12 N rows."""
    H = scratch + 12 * N
    _curvature_rows(w, N, now, inverse, error, L, scratch)
    _lower_gram(w, scratch, 2 * N, H)
    _add_curvature_terms(w, N, now, inverse, error, weights, H)


@part
def newton_update(w, N, image, weights, L, slow, moving, u, scratch):
    """Compute the update u of moving runs from N marks. Return the mask of runs with singular L' L.

    A slow run with a convex f receives Newton's update, any other run the Gauss-Newton update. The
    image has points, inverse depths and errors. The errors and L are weighted. `scratch` has
    14 N + 42 rows.
    """
    now, inverse, error = image
    H, solution, slow_error = scratch + 12 * N, scratch + 12 * N + 36, scratch + 12 * N + 42
    for i in range(2 * N):
        put(w, slow_error + i, where(slow, get(w, error + i), 0.0))
    flat = moving
    # The loop compiles the common code once. Without slow runs L' L is the Hessian.
    for attempt in range(0 if any_lane(slow) else 1, 2):
        if attempt == 0:
            pose_hessian(w, N, now, inverse, slow_error, weights, L, scratch)
        else:
            _lower_gram(w, L, 2 * N, H)
        unsound = _factorise_ldl(w, H)
        _descent_direction(w, L, error, 2 * N, solution)
        _solve_ldl(w, H, solution)
        for i in range(6):
            put(w, u + i, where(flat, get(w, solution + i), get(w, u + i)))
        flat = flat & unsound
        if not any_lane(flat):
            break
    return flat
