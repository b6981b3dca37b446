! The Sadowsky ribbon's strong form for AUTO-07p: equations and symbols as in tests/reference/strong_form.py, K constant.
! U = (g_1, g_2, g_3, omega, eta, M_2, s), PAR(1) the share of the weight, from 0 (natural shape) to 1.
module ribbon_case
  implicit none
  double precision, save :: gam, k, nu, g0(3)
end module

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  use ribbon_case
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: g1, g2, g3, w, e, m, c, e2, a, v, first, third, p, q, r, below, other, top, second, stiff
  double precision :: fx(2), tx(2), px(2), qx(2), ax(2), vx(2), cs
  integer :: i
  g1 = u(1); g2 = u(2); g3 = u(3); w = u(4); e = u(5); m = u(6)
  c = par(1)*gam*(1d0 - u(7))
  e2 = e*e; a = 1d0 + e2; v = w*a - nu*k
  first = e*w*m - c*g2; third = -w*m
  p = w*(1d0 + 3d0*e2) - nu*k; q = e*(nu*k - 2d0*w*e2); r = 0.5d0*(1d0 - e2)
  below = a*a*v; other = a*v; top = p*first - q*third; second = r*third - e*first
  f(1) = e*w*g2
  f(2) = w*(g3 - e*g1)
  f(3) = -w*g2
  f(4) = top/below
  f(5) = second/other
  f(6) = w*e*(w*a*a + k*(1d0 - 2d0*nu - nu*e2)) + c*g1
  f(7) = 1d0
  if (ijac == 0) return
  dfdu = 0d0
  dfdu(1,2) = e*w; dfdu(1,4) = e*g2; dfdu(1,5) = w*g2
  dfdu(2,1) = -w*e; dfdu(2,3) = w; dfdu(2,4) = g3 - e*g1; dfdu(2,5) = -w*g1
  dfdu(3,2) = -w; dfdu(3,4) = -g2
  dfdu(4,2) = -p*c/below; dfdu(5,2) = e*c/other
  dfdu(4,6) = (p*e*w + q*w)/below; dfdu(5,6) = -(r*w + e2*w)/other
  fx = (/ e*m, w*m /); tx = (/ -m, 0d0 /)
  px = (/ 1d0 + 3d0*e2, 6d0*w*e /); qx = (/ -2d0*e*e2, nu*k - 6d0*w*e2 /)
  ax = (/ 0d0, 2d0*e /); vx = (/ a, 2d0*w*e /)
  do i = 1, 2
    dfdu(4,3+i) = (px(i)*first + p*fx(i) - qx(i)*third - q*tx(i) - top*(2d0*a*ax(i)*v + a*a*vx(i))/below)/below
    dfdu(5,3+i) = (r*tx(i) - e*fx(i) - second*(ax(i)*v + a*vx(i))/other)/other
  end do
  dfdu(5,5) = dfdu(5,5) + (-e*third - first)/other
  stiff = w*a*a + k*(1d0 - 2d0*nu - nu*e2)
  dfdu(6,1) = c; dfdu(6,4) = e*(stiff + w*a*a); dfdu(6,5) = w*(stiff + e2*(4d0*w*a - 2d0*nu*k))
  ! by c, then c by s and by the share
  cs = -par(1)*gam
  dfdu(4,7) = -p*g2/below*cs; dfdu(5,7) = e*g2/other*cs; dfdu(6,7) = g1*cs
  if (ijac == 1) return
  cs = gam*(1d0 - u(7))
  dfdp(1:ndim,1) = 0d0
  dfdp(4,1) = -p*g2/below*cs; dfdp(5,1) = e*g2/other*cs; dfdp(6,1) = g1*cs
end subroutine

subroutine stpnt(ndim, u, par, t)
  use ribbon_case
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  logical, save :: begun = .false.
  if (.not. begun) then
    open(77, file='case.txt', status='old')
    read(77, *) gam, k, nu, g0
    close(77)
    begun = .true.
  end if
  par(1) = 0d0
  u(1) = g0(1)
  u(2) = g0(2)*cos(k*t) + g0(3)*sin(k*t)
  u(3) = g0(3)*cos(k*t) - g0(2)*sin(k*t)
  u(4) = k; u(5) = 0d0; u(6) = 0d0; u(7) = t
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  use ribbon_case
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc, *)
  integer :: i
  fb(1:3) = u0(1:3) - g0
  fb(4) = u0(7)
  fb(5) = u1(4) - k
  fb(6) = u1(5)
  fb(7) = u1(6)
  if (ijac == 0) return
  dbc(:, 1:2*ndim) = 0d0
  do i = 1, 3
    dbc(i, i) = 1d0
    dbc(4+i, ndim+3+i) = 1d0
  end do
  dbc(4, 7) = 1d0
  if (ijac == 1) return
  dbc(:, 2*ndim+1) = 0d0
end subroutine

subroutine icnd(ndim, par, icp, nint, u, uold, udot, upold, fi, ijac, dint)
  integer ndim, icp(*), nint, ijac
  double precision par(*), u(*), uold(*), udot(*), upold(*), fi(*), dint(nint, *)
end subroutine

subroutine fopt(ndim, u, icp, par, ijac, fs, dfdu, dfdp)
  integer ndim, icp(*), ijac
  double precision u(*), par(*), fs, dfdu(*), dfdp(*)
end subroutine

subroutine pvls(ndim, u, par)
  integer ndim
  double precision u(*), par(*)
end subroutine
