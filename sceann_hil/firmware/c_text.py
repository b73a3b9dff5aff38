"""The C text that every exported header is made of; ``header`` fills it in.

``@name`` and ``NAME`` stand for the header's prefix, other ``@`` words for what depends on the form.
"""

from __future__ import annotations

KEYWORDS = frozenset(
    """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t char32_t
    class compl concept const const_cast consteval constexpr constinit continue co_await co_return
    co_yield decltype default delete do double dynamic_cast else enum explicit export extern false float
    for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq
    private protected public register reinterpret_cast requires restrict return short signed sizeof static
    static_assert static_cast struct switch template this thread_local throw true try typedef typeid
    typename union unsigned using virtual void volatile wchar_t while xor xor_eq main
    """.split()  # noqa: SIM905 - a list of a hundred literals is harder to read
)
"""What C or C++ does not take as a prefix."""

PLAIN_NEURON = r"""
/* The refractory reset and the sigmoid: beyond +-8192 u becomes 0@silent.
 * x = T[k] + ((T[k+1] - T[k]) f + 64 >> 7) with u + 8192 = 128 k + f@table_note */
static inline uint32_t @name_neuron(uint32_t s, uint16_t *u_i)
{
    const uint32_t z = (s + 8192u) & 0xFFFFu, sum = z - 8192u, keep = ((16384u - z) >> 31) - 1u;
    const uint32_t u = sum & keep, shifted = u + 8192u, k = shifted >> 7;
@plain_look_up
    const uint32_t x = low + ((slope * (shifted & 127u) + 64u) >> 7);
    *u_i = (uint16_t)u;
    return @output;
}
"""

PLAIN_FULL_LOOK_UP = (
    """    const uint32_t low = NAME_WORD(@name_nodes + k), slope = NAME_WORD(@name_nodes + k + 1) - low;"""
)

PLAIN_HALF_LOOK_UP = """    const uint32_t upper = 0u - (uint32_t)(k >= 64u);
    const uint16_t *const node = @name_nodes + (((k ^ upper) + (upper & 128u) + 1u) & 0xFFu);
    const uint32_t first = NAME_WORD(node), second = NAME_WORD(node + 1);
    const uint32_t slope = second - first, low = first ^ ((first ^ (1024u - second)) & upper);"""

HALF_NOTE = """.
 * The table holds a 0, then the lower half of T: T[128 - k] = 1024 - T[k]."""

AVR_HALF_NEURON = r"""
/* The refractory reset and the sigmoid: u in the low half, x in the high half. Beyond +-8192 u becomes 0@silent.
 * x = T[k] + ((T[k+1] - T[k]) f + 64 >> 7) with u + 8192 = 128 k + f@table_note */
static __attribute__((noinline, unused)) uint32_t @name_avr_neuron(uint16_t sum)
{
    uint32_t v;
    uint16_t z, top;
    uint8_t f, t, keep, upper;
    __asm__("movw %A[z], %A[sum] \n\t"
            "movw %A[v], %A[z] \n\t"
            "subi %B[z], 0xE0 \n\t"              /* z = sum + 8192 */
            "cp __zero_reg__, %A[z] \n\t"
            "ldi %[t], 0x40 \n\t"
            "cpc %[t], %B[z] \n\t"               /* carry: z > 16384 */
            "sbc %[keep], %[keep] \n\t"
            "com %[keep] \n\t"
            "and %A[v], %[keep] \n\t"
            "and %B[v], %[keep] \n\t"
            "mov %A[z], %B[v] \n\t"
            "subi %A[z], 0xE0 \n\t"
            "mov %[f], %A[v] \n\t"
            "lsl %[f] \n\t"
            "rol %A[z] \n\t"                     /* k */
            "mov %[t], %A[z] \n\t"
            "subi %[t], 64 \n\t"
            "sbc %[upper], %[upper] \n\t"
            "com %[upper] \n\t"                  /* 0xFF for k >= 64, else 0 */
            "eor %A[z], %[upper] \n\t"
            "mov %[t], %[upper] \n\t"
            "andi %[t], 0x80 \n\t"
            "add %A[z], %[t] \n\t"
            "inc %A[z] \n\t"                     /* k + 1 or 128 - k */
            "lsl %A[z] \n\t"
            "clr %B[z] \n\t"
            "subi %A[z], lo8(-(%[table])) \n\t"
            "sbci %B[z], hi8(-(%[table])) \n\t"
            "lpm %C[v], Z+ \n\t"
            "lpm %D[v], Z+ \n\t"
            "lpm %A[top], Z+ \n\t"
            "lpm r0, Z \n\t"
            "mov %[t], %A[top] \n\t"
            "sub %[t], %C[v] \n\t"               /* T[k+1] - T[k], the same in both halves */
            "ldi %B[top], 4 \n\t"
            "neg %A[top] \n\t"
            "sbc %B[top], r0 \n\t"
            "sbrc %[upper], 0 \n\t"              /* two cycles, skipping or not */
            "movw %C[v], %A[top] \n\t"
            "mul %[t], %[f] \n\t"
            "lsl r0 \n\t"
            "adc %C[v], r1 \n\t"
            "clr r1 \n\t"
            "adc %D[v], r1@masked"
            : [v] "=r"(v), [z] "=&z"(z), [f] "=&r"(f), [t] "=&d"(t), [keep] "=&r"(keep),
              [upper] "=&r"(upper), [top] "=&d"(top)
            : [sum] "r"(sum), [table] "i"(@name_nodes)
            : "r0");
    return v;
}
"""

AVR_MASK_X = r"""            "and %C[v], %[keep] \n\t"
            "and %D[v], %[keep]"""

Q10 = r"""
/* 10-bit sensor to Q10: r + (r >> 9), so that mid-scale is symmetric about 512 */
static inline uint32_t @name_q10(uint32_t r)
{
    return r + (r >> 9);
}
"""
