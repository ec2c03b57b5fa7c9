"""Verner's "efficient" Runge-Kutta pair of order 8(7): thirteen stages, one function for each stage's linear combination.

The coefficients are those of J. H. Verner, "Numerically optimal Runge-Kutta pairs with interpolants", Numerical Algorithms 53 (2010)
383-396, as published on his web site and used by other ODE suites under the name Vern8. Those with short fractions are
written as such, the others are the doubles nearest to their exact fractions. Zero coefficients are left out: the second and third stage
serve only the fourth and fifth.

Each function takes one component: its value ``y``, the step ``h`` and the stage derivatives ``k1``, ``k2``, ... that the stage uses, so that
a model of any number of coordinates is written out in straight lines that a compiler can vectorise over walkers.
"""

from lean_yaw_env.kernel.compilation import fused

STAGES = 13
ORDER = 8

C2 = 1 / 20
C3 = 341 / 3200
C4 = 1023 / 6400
C5 = 39 / 100
C6 = 93 / 200
C7 = 31 / 200
C8 = 943 / 1000
C9 = 7067558016280 / 7837150160667
C10 = 909 / 1000
C11 = 47 / 50

A2_1 = 1 / 20
A3_1 = -7161 / 1024000
A3_2 = 116281 / 1024000
A4_1 = 1023 / 25600
A4_3 = 3069 / 25600
A5_1 = 4202367 / 11628100
A5_3 = -3899844 / 2907025
A5_4 = 3982992 / 2907025
A6_1 = 5611 / 114400
A6_4 = 31744 / 135025
A6_5 = 923521 / 5106400
A7_1 = 21173 / 343200
A7_4 = 8602624 / 76559175
A7_5 = -26782109 / 689364000
A7_6 = 5611 / 283500
A8_1 = -1221101821869329 / 690812928000000
A8_4 = -125 / 2
A8_5 = -1024030607959889 / 168929280000000
A8_6 = 1501408353528689 / 265697280000000
A8_7 = 6070139212132283 / 92502016000000
A9_1 = -1.1809450665549708
A9_4 = -41.50473441114321
A9_5 = -4.434438319103725
A9_6 = 4.260408188586133
A9_7 = 43.75364022446172
A9_8 = 0.00787142548991231
A10_1 = -1.2814059994414884
A10_4 = -45.047139960139866
A10_5 = -4.731362069449577
A10_6 = 4.514967016593808
A10_7 = 47.44909557172985
A10_8 = 0.010592282971116612
A10_9 = -0.0057468422638446166
A11_1 = -1.7244701342624853
A11_4 = -60.92349008483054
A11_5 = -5.951518376222393
A11_6 = 5.556523730698456
A11_7 = 63.98301198033305
A11_8 = 0.014642028250414961
A11_9 = 0.06460408772358203
A11_10 = -0.0793032316900888
A12_1 = -3.301622667747079
A12_4 = -118.01127235975251
A12_5 = -10.141422388456112
A12_6 = 9.139311332232058
A12_7 = 123.37594282840426
A12_8 = 4.62324437887458
A12_9 = -3.3832777380682018
A12_10 = 4.527592100324618
A12_11 = -5.828495485811623
A13_1 = -3.039515033766309
A13_4 = -109.26086808941763
A13_5 = -9.290642497400293
A13_6 = 8.43050498176491
A13_7 = 114.20100103783314
A13_8 = -0.9637271342145479
A13_9 = -5.0348840888021895
A13_10 = 5.958130824002923

B1 = 0.04427989419007951
B6 = 0.3541049391724449
B7 = 0.2479692154956438
B8 = -15.694202038838084
B9 = 25.084064965558564
B10 = -31.738367786260277
B11 = 22.938283273988784
B12 = -0.2361324633071542

# The weights of the eighth-order result minus those of the embedded seventh-order one.
E1 = -3.2721039010281375e-05
E6 = -0.0005046250618777704
E7 = 0.0001211723589784759
E8 = -20.142336771313868
E9 = 5.2371785994398286
E10 = -8.156744408794658
E11 = 22.938283273988784
E12 = -0.2361324633071542
E13 = 0.36016794372897754


@fused
def stage_2(y, h, k1):
    return y + h * (A2_1 * k1)


@fused
def stage_3(y, h, k1, k2):
    return y + h * (A3_1 * k1 + A3_2 * k2)


@fused
def stage_4(y, h, k1, k3):
    return y + h * (A4_1 * k1 + A4_3 * k3)


@fused
def stage_5(y, h, k1, k3, k4):
    return y + h * (A5_1 * k1 + A5_3 * k3 + A5_4 * k4)


@fused
def stage_6(y, h, k1, k4, k5):
    return y + h * (A6_1 * k1 + A6_4 * k4 + A6_5 * k5)


@fused
def stage_7(y, h, k1, k4, k5, k6):
    return y + h * (A7_1 * k1 + A7_4 * k4 + A7_5 * k5 + A7_6 * k6)


@fused
def stage_8(y, h, k1, k4, k5, k6, k7):
    return y + h * (A8_1 * k1 + A8_4 * k4 + A8_5 * k5 + A8_6 * k6 + A8_7 * k7)


@fused
def stage_9(y, h, k1, k4, k5, k6, k7, k8):
    return y + h * (A9_1 * k1 + A9_4 * k4 + A9_5 * k5 + A9_6 * k6 + A9_7 * k7 + A9_8 * k8)


@fused
def stage_10(y, h, k1, k4, k5, k6, k7, k8, k9):
    return y + h * (
        A10_1 * k1 + A10_4 * k4 + A10_5 * k5 + A10_6 * k6 + A10_7 * k7 + A10_8 * k8 + A10_9 * k9
    )


@fused
def stage_11(y, h, k1, k4, k5, k6, k7, k8, k9, k10):
    return y + h * (
        A11_1 * k1
        + A11_4 * k4
        + A11_5 * k5
        + A11_6 * k6
        + A11_7 * k7
        + A11_8 * k8
        + A11_9 * k9
        + A11_10 * k10
    )


@fused
def stage_12(y, h, k1, k4, k5, k6, k7, k8, k9, k10, k11):
    return y + h * (
        A12_1 * k1
        + A12_4 * k4
        + A12_5 * k5
        + A12_6 * k6
        + A12_7 * k7
        + A12_8 * k8
        + A12_9 * k9
        + A12_10 * k10
        + A12_11 * k11
    )


@fused
def stage_13(y, h, k1, k4, k5, k6, k7, k8, k9, k10):
    return y + h * (
        A13_1 * k1
        + A13_4 * k4
        + A13_5 * k5
        + A13_6 * k6
        + A13_7 * k7
        + A13_8 * k8
        + A13_9 * k9
        + A13_10 * k10
    )


@fused
def result(y, h, k1, k6, k7, k8, k9, k10, k11, k12):
    """The eighth-order result at the end of the step."""
    return y + h * (
        B1 * k1 + B6 * k6 + B7 * k7 + B8 * k8 + B9 * k9 + B10 * k10 + B11 * k11 + B12 * k12
    )


@fused
def error(h, k1, k6, k7, k8, k9, k10, k11, k12, k13):
    """The result's difference from the embedded seventh-order one."""
    return h * (
        E1 * k1
        + E6 * k6
        + E7 * k7
        + E8 * k8
        + E9 * k9
        + E10 * k10
        + E11 * k11
        + E12 * k12
        + E13 * k13
    )
