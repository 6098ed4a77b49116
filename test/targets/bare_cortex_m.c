/* All that a Cortex-M needs to run `main` without an operating system and a library; it prints by semihosting. */
#include <stddef.h>
#include <stdint.h>

extern int main(void);
extern uint32_t stack_end, bss_begin, bss_end;

static void semihost(uint32_t operation, uintptr_t argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register uintptr_t r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

int puts(const char *text)
{
    semihost(0x04u, (uintptr_t)text); /* SYS_WRITE0 */
    return 0;
}

void *memset(void *to, int value, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        ((volatile unsigned char *)to)[k] = (unsigned char)value;
    }
    return to;
}

void *memcpy(void *to, const void *from, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        ((volatile unsigned char *)to)[k] = ((const unsigned char *)from)[k];
    }
    return to;
}

void reset(void)
{
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR: the floating-point unit on */
    __asm__ volatile("dsb\nisb");
    for (uint32_t *word = &bss_begin; word < &bss_end; word++) {
        *word = 0;
    }
    const uint32_t ended[2] = { 0x20026u, (uint32_t)main() }; /* ADP_Stopped_ApplicationExit */
    semihost(0x20u, (uintptr_t)ended);                        /* SYS_EXIT_EXTENDED */
}

void fault(void)
{
    const uint32_t ended[2] = { 0x20026u, 3u };
    semihost(0x20u, (uintptr_t)ended);
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    &stack_end, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault,
};
